"""Flags of a program that may be read before they are set anew, after each of its instructions.

A translated guest leaves out the others. Nothing of a program depends on them: an interrupt saves
the status register and restores it. What is not known to be dead counts as live: behind `ret`,
`reti`, `ijmp` and `icall` all flags are, since libgcc's functions hand some back.
"""

from collections import deque
from collections.abc import Callable, Mapping

from kilotwin.build.avr_instructions import Instruction

ALL_FLAGS = 0xFF
_C, _Z, _T = 1 << 0, 1 << 1, 1 << 6
_SREG = 0x5F
_OF_SUMS = 0x3F  # C Z N V S H
_OF_SHIFTS = 0x1F  # without H
_OF_BITS = 0x1E  # without C and H

_SETS = {
    **dict.fromkeys(("add", "adc", "sub", "subi", "sbc", "sbci", "neg"), _OF_SUMS),
    **dict.fromkeys(("cp", "cpi", "cpc"), _OF_SUMS),
    **dict.fromkeys(("com", "lsr", "asr", "ror", "adiw", "sbiw"), _OF_SHIFTS),
    **dict.fromkeys(("and", "andi", "or", "ori", "eor", "inc", "dec"), _OF_BITS),
    **dict.fromkeys(("mul", "muls", "mulsu", "fmul", "fmuls", "fmulsu"), _C | _Z),
    "bst": _T,
}
_READS = {
    **dict.fromkeys(("adc", "ror", "sbc", "sbci", "cpc"), _C),
    "bld": _T,
}
_KEEP_Z = {"sbc", "sbci", "cpc"}  # they clear Z or leave it
_CALLS = {"call", "rcall", "jmp", "rjmp"}
_ANYWHERE = {"ret", "reti", "ijmp", "icall", "invalid"}


def flags_set(instruction: Instruction) -> int:
    """Those that it sets whatever they were, as bits of the status register."""
    if instruction.name in ("bset", "bclr"):
        return 1 << instruction.k
    if instruction.name in ("out", "sts") and instruction.k == _SREG:
        return ALL_FLAGS
    return _SETS.get(instruction.name, 0)


def flags_read(instruction: Instruction, live: int) -> int:
    """Those that what it does depends on, where `live` are read behind it."""
    if instruction.name in ("brbs", "brbc"):
        return 1 << instruction.k
    if instruction.name in ("in", "lds") and instruction.k == _SREG:
        return ALL_FLAGS
    kept = live & _Z if instruction.name in _KEEP_Z else 0
    return _READS.get(instruction.name, 0) | kept


def live_flags(
    instructions: Mapping[int, Instruction], skipped_to: Callable[[Instruction], int]
) -> dict[int, int]:
    """By address, the flags that may be read after that instruction; `skipped_to` says where a
    skip leads to. Time O(instructions)."""
    followers = {
        at: _followers(instruction, skipped_to) for at, instruction in instructions.items()
    }
    before: dict[int, list[int]] = {}
    for at, ahead in followers.items():
        for follower in ahead or ():
            before.setdefault(follower, []).append(at)
    needed = dict.fromkeys(instructions, 0)  # by an instruction and what follows it
    after = dict.fromkeys(instructions, 0)
    waiting = deque(sorted(instructions, reverse=True))
    while waiting:
        at = waiting.popleft()
        ahead = followers[at]
        after[at] = ALL_FLAGS
        if ahead is not None and all(follower in needed for follower in ahead):
            after[at] = 0
            for follower in ahead:
                after[at] |= needed[follower]
        instruction = instructions[at]
        now = (after[at] & ~flags_set(instruction)) | flags_read(instruction, after[at])
        if now != needed[at]:
            needed[at] = now
            waiting.extend(before.get(at, ()))
    return after


def _followers(
    instruction: Instruction, skipped_to: Callable[[Instruction], int]
) -> tuple[int, ...] | None:
    """Addresses of what may be executed next; None: anything."""
    name = instruction.name
    if name in _ANYWHERE:
        return None
    if name in _CALLS:
        return (instruction.target,)
    if name in ("brbs", "brbc"):
        return (instruction.target, instruction.end)
    if name in ("cpse", "sbrc", "sbrs", "sbic", "sbis"):
        return (skipped_to(instruction), instruction.end)
    return (instruction.end,)
