"""Places in a program between which an interrupt matters: accesses to a number of several bytes
that a callback shares with loop().

On the chip an interrupt comes between any two instructions, so that one of these numbers may be
torn. Translated code lets interrupts through where a block begins, so that one begins between two
bytes of such a number. Bytes are known by their addresses in the code: what only a pointer leads
to is not looked for, nor kilo_ticks, which every pass reads.
"""

from collections.abc import Callable, Iterable, Mapping

from kilotwin.programs.translate.instructions import Instruction
from kilotwin.programs.translate.liveness import followers

_CALLS = {"call", "rcall"}
_STARTS = _CALLS | {"jmp", "rjmp"}
_IO_END = 0x100
# Arguments of kilo_start(): setup() and loop(), which no interrupt calls.
_SETUP, _LOOP = 24, 22
_MOST_BEFORE_CALL = 16  # bytes that ldi of these take, with some others between


def tearing(
    instructions: Mapping[int, Instruction],
    skipped_to: Callable[[Instruction], int],
    kilo_start: int,
    pointed: Iterable[int],
) -> set[int]:
    """Addresses of instructions before each of which an interrupt may tear a number; `pointed` are
    functions that a pointer may lead to, `kilo_start` is where that function begins. Empty where
    the program's loop() cannot be told from its callbacks. Time O(instructions)."""
    started = _started(instructions, kilo_start)
    if started is None:
        return set()
    setup, loop = started
    inside = _reached(instructions, skipped_to, [loop])
    roots = [at for at in pointed if at in instructions and at not in (setup, loop, kilo_start)]
    callbacks = _reached(instructions, skipped_to, roots)
    own, theirs = (_accessed(instructions, of) for of in (inside, callbacks))
    shared = {at for at in own.keys() & theirs.keys() if own[at] or theirs[at]}
    places = set()
    last: Instruction | None = None
    for at in sorted(inside):
        instruction = instructions[at]
        if not _is_access(instruction) or instruction.k not in shared:
            continue
        if last is not None and _follows(last, instruction):
            places.add(at)
        last = instruction
    return places


def _follows(last: Instruction, instruction: Instruction) -> bool:
    """Whether both access neighbouring bytes, and little code is between them."""
    near = instruction.address - last.end <= _MOST_BEFORE_CALL
    return near and abs(instruction.k - last.k) == 1


def _is_access(instruction: Instruction) -> bool:
    return instruction.name in ("lds", "sts") and instruction.k >= _IO_END


def _accessed(instructions: Mapping[int, Instruction], where: Iterable[int]) -> dict[int, bool]:
    """Bytes by address, and whether one of these instructions writes it."""
    found: dict[int, bool] = {}
    for at in where:
        if _is_access(instructions[at]):
            byte = instructions[at].k
            found[byte] = found.get(byte, False) or instructions[at].name == "sts"
    return found


def _started(instructions: Mapping[int, Instruction], kilo_start: int) -> tuple[int, int] | None:
    """setup() and loop(), by the registers that are loaded before kilo_start() is called."""
    for instruction in instructions.values():
        if instruction.name not in _STARTS or instruction.target != kilo_start:
            continue
        loaded: dict[int, int] = {}
        for at in range(instruction.address - _MOST_BEFORE_CALL, instruction.address, 2):
            before = instructions.get(at)
            if before is not None and before.name == "ldi":
                loaded[before.d] = before.k
        if all(register in loaded for one in (_SETUP, _LOOP) for register in (one, one + 1)):
            setup, loop = (2 * (loaded[one] | loaded[one + 1] << 8) for one in (_SETUP, _LOOP))
            return setup, loop
    return None


def _reached(
    instructions: Mapping[int, Instruction],
    skipped_to: Callable[[Instruction], int],
    begins: Iterable[int],
) -> set[int]:
    """Instructions of these functions, and of those that they call."""
    reached: set[int] = set()
    waiting = list(begins)
    while waiting:
        at = waiting.pop()
        if at in reached or at not in instructions:
            continue
        reached.add(at)
        instruction = instructions[at]
        waiting += followers(instruction, skipped_to)
        if instruction.name in _CALLS:
            waiting.append(instruction.target)
    return reached
