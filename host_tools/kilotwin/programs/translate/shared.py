"""Places in a program between which an interrupt matters: accesses to a number of several bytes
that a callback shares with loop().

On the chip an interrupt comes between any two instructions, so that one of these numbers may be
torn. Translated code lets interrupts through where a block begins, so that one begins between two
bytes of such a number. Bytes that loop() accesses by their addresses count if a callback accesses
them so, or has the address of their variable; neighbouring bytes that loop() accesses by a pointer
always do, but for those on the stack. kilo_ticks, which every pass reads, does not.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence

from kilotwin.programs.translate.instructions import Instruction
from kilotwin.programs.translate.liveness import followers

_CALLS = {"call", "rcall"}
_STARTS = _CALLS | {"jmp", "rjmp"}
_IO_END = 0x100
_LOADS, _STORES = {"ld", "ld+", "-ld", "ldd"}, {"st", "st+", "-st", "std"}
_MOVING = {"ld+", "-ld", "st+", "-st"}
_POINTERS, _Y = {26, 30}, 28  # X and Z
_SETS_Y = {"in", "ldi", "movw"}
_MOST_BETWEEN = 6  # bytes between two such accesses
# Arguments of kilo_start(): setup() and loop(), which no interrupt calls.
_SETUP, _LOOP = 24, 22
_MOST_BEFORE_CALL = 16  # bytes that ldi of these take, with some others between


def tearing(
    instructions: Mapping[int, Instruction],
    skipped_to: Callable[[Instruction], int],
    kilo_start: int,
    pointed: Iterable[int],
    objects: Sequence[tuple[int, int]],
) -> set[int]:
    """Addresses of instructions before each of which an interrupt may tear a number; `pointed` are
    functions that a pointer may lead to, `kilo_start` is where that function begins, `objects` are
    the program's variables: addresses and sizes. Empty where the program's loop() cannot be told
    from its callbacks. Time O(instructions)."""
    started = _started(instructions, kilo_start)
    if started is None:
        return set()
    setup, loop = started
    inside = _reached(instructions, skipped_to, [loop])
    roots = [at for at in pointed if at in instructions and at not in (setup, loop, kilo_start)]
    callbacks = _reached(instructions, skipped_to, roots)
    own, theirs = (_accessed(instructions, of) for of in (inside, callbacks))
    shared = {at for at in own.keys() & theirs.keys() if own[at] or theirs[at]}
    named = _addresses_in(instructions, callbacks)
    for begin, size in objects:
        there = range(begin, begin + size)
        if size > 1 and not named.isdisjoint(there):
            shared.update(there)
    places = set()
    last: Instruction | None = None
    last_pointed: Instruction | None = None
    on_stack = False  # is what Y points to, once the stack pointer has been read into it
    for at in sorted(inside):
        instruction = instructions[at]
        if instruction.d == _Y and instruction.name in _SETS_Y:
            on_stack = instruction.name == "in"
        pointers = _POINTERS if on_stack else _POINTERS | {_Y}
        if instruction.name in _LOADS | _STORES and instruction.r in pointers:
            if last_pointed is not None and _neighbours(last_pointed, instruction):
                places.add(at)
            last_pointed = instruction
        if not _is_access(instruction) or instruction.k not in shared:
            continue
        if last is not None and _follows(last, instruction):
            places.add(at)
        last = instruction
    return places


def _addresses_in(instructions: Mapping[int, Instruction], where: Iterable[int]) -> set[int]:
    """Numbers that pairs of `ldi` load there: addresses, maybe."""
    found = set()
    for at in where:
        low = instructions[at]
        high = instructions.get(low.end)
        if low.name == "ldi" and high and high.name == "ldi" and high.d == low.d + 1:
            found.add(low.k | high.k << 8)
    return found


def _neighbours(last: Instruction, instruction: Instruction) -> bool:
    """Whether both read, or both write, neighbouring bytes by the same pointer, with little code
    between them. Where that moves the pointer it is the next byte, mostly."""
    alike = last.r == instruction.r and (last.name in _LOADS) == (instruction.name in _LOADS)
    moves = last.name in _MOVING or instruction.name in _MOVING
    near = instruction.address - last.end <= _MOST_BETWEEN
    return near and alike and (moves or abs(instruction.k - last.k) == 1)


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
