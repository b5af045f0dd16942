"""Flags of a program that may be read before they are set anew, after each of its instructions.

A translated guest leaves out the others. Nothing of a program depends on them: an interrupt saves
the status register and restores it. What is not known to be dead counts as live: behind `ret`,
`reti`, `ijmp` and `icall` all flags are, since libgcc's functions hand some back.
"""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from operator import or_

from kilotwin.programs.translate.instructions import Instruction

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

    def ahead(instruction: Instruction) -> Sequence[int] | None:
        if instruction.name in _ANYWHERE:
            return None
        if instruction.name in _CALLS:
            return (instruction.target,)
        return followers(instruction, skipped_to)

    def needed(instruction: Instruction, after: int) -> int:
        return (after & ~flags_set(instruction)) | flags_read(instruction, after)

    def together(_: Instruction, read: Sequence[int]) -> int:
        return reduce(or_, read, 0)

    return live_after(instructions, ahead, needed, together, ALL_FLAGS)


def live_after(
    instructions: Mapping[int, Instruction],
    ahead: Callable[[Instruction], Sequence[int] | None],
    needed: Callable[[Instruction, int], int],
    joined: Callable[[Instruction, Sequence[int]], int],
    everything: int,
) -> dict[int, int]:
    """By address, the bits of what may be read after that instruction.

    `ahead` says which addresses may be next, None where that may be any; `joined` what is read
    after an instruction by what is read from each of these on, and `needed` what an instruction and
    those behind it read by that. Where the next address has no instruction `everything` is read.
    """
    leads_to = {at: ahead(instruction) for at, instruction in instructions.items()}
    before: dict[int, list[int]] = {}
    for at, following in leads_to.items():
        for follower in following or ():
            before.setdefault(follower, []).append(at)
    read = dict.fromkeys(instructions, 0)  # by an instruction and what follows it
    after = dict.fromkeys(instructions, 0)
    waiting = deque(sorted(instructions, reverse=True))
    while waiting:
        at = waiting.popleft()
        following = leads_to[at]
        after[at] = everything
        if following is not None and all(follower in read for follower in following):
            after[at] = joined(instructions[at], [read[follower] for follower in following])
        now = needed(instructions[at], after[at])
        if now != read[at]:
            read[at] = now
            waiting.extend(before.get(at, ()))
    return after


def followers(
    instruction: Instruction, skipped_to: Callable[[Instruction], int]
) -> tuple[int, ...]:
    """Addresses of what a function may execute next; a call's is what comes behind it."""
    name = instruction.name
    if name in ("ret", "reti", "ijmp", "invalid"):
        return ()
    if name in ("jmp", "rjmp"):
        return (instruction.target,)
    if name in ("brbs", "brbc"):
        return (instruction.target, instruction.end)
    if name in ("cpse", "sbrc", "sbrs", "sbic", "sbis"):
        return (skipped_to(instruction), instruction.end)
    return (instruction.end,)
