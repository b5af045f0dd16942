"""Routines of avr-libc and libgcc that the engine computes itself, for speed alone
(emulator/robots/translated/routines/routines.h): they are found by their instructions, wherever a
linker has put them. Code that is marked for coverage executes each instruction, and is what tests
hold these against.

A routine is known by the digest of all instructions that its begin leads to, in an order that does
not depend on addresses. Only calls and jumps may be short or long.
"""

import hashlib
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from kilotwin.programs.translate.instructions import Instruction
from kilotwin.programs.translate.statements import SKIPS

_SHORT = {"call": "rcall", "jmp": "rjmp"}
_TRANSFERS = {"rcall", "rjmp"}
_ENDS = {"ret", "rjmp"}
_BRANCHES = {"brbs", "brbc"}
# A routine with another instruction is none of those.
_NEVER = {"reti", "ijmp", "icall", "invalid", "lds", "sts", "in", "out", "sbi", "cbi"}
_MOST_INSTRUCTIONS = 400
_LONG = 1 << 15
_BEGINS = 3  # instructions of a key of ROUTINES
_DIGEST_CHARACTERS = 16

ROUTINES: dict[tuple[str, ...], dict[str, str]] = {
    ("eor", "eor", "rcall"): {"dd7666eaedd345d4": "ADDSF3"},
    ("subi", "eor", "eor"): {"958c06368179e13e": "SUBSF3"},
    ("mov", "rcall", "brbs"): {"8f098d2874fb2c4d": "ADDSF3X"},
    ("rcall", "rjmp", "rcall"): {"2e9fb16ae1c7346d": "MULSF3", "567a27dc1f2c394d": "DIVSF3"},
    ("rcall", "brbc", "ldi"): {"baa5a1cd3eb6c1a3": "CMPSF2", "4a31669cb69980a1": "GESF2"},
    ("push", "push", "push"): {
        "a2889ea5f5735838": "POWSER",
        "cdd3aaecadd63e12": "POWSODD",
        "05ec7aa6c0d63e38": "DO_RAND",
    },
    ("bst", "brbc", "com"): {"8362565688bc4755": "FLOATSISF"},
    ("bclr", "rjmp", "bst"): {"839385905c42377f": "FLOATUNSISF"},
    ("sub", "sub", "ldi"): {"ce5796a9ee3ae3a8": "UDIVMODHI4"},
    ("bst", "mov", "brbc"): {"c57bb9169aaf58fc": "DIVMODHI4"},
    ("ldi", "mov", "sub"): {"ed61cb0293ac565e": "UDIVMODSI4"},
    ("mov", "bst", "brbc"): {"530eba21009dd0d4": "DIVMODSI4"},
}
"""By the names of the first three instructions in the flash, then by digest: names as routines.h
has them, behind ROUTINE_. Those of avr-libc 2.0.0 and of the libgcc of gcc 5.4, as
Debian has them; whether another version's are the same instructions was not looked at."""

NUMBERS = ((22, 23, 24, 25), (18, 19, 20, 21), (0, 26, 27, 1), (30, 31))
"""Registers that are handed over, as `numbers` of translated_chip_t has them."""


@dataclass(frozen=True)
class Routine:
    """One that is known."""

    name: str
    sites: tuple[int, ...]
    """For each call and jump, in the digest's order: the word address behind it, and _LONG if it
    takes a cycle more than the short one."""
    addresses: frozenset[int]
    """Addresses of its instructions."""
    pushed: frozenset[int]
    """Registers that it pushes."""


@dataclass(frozen=True)
class Shape:
    """All instructions that an address leads to."""

    digest: str
    order: tuple[Instruction, ...]

    def sites(self) -> tuple[int, ...]:
        """As of Routine."""
        return tuple(
            one.end // 2 | (_LONG if one.name in _SHORT else 0)
            for one in self.order
            if _SHORT.get(one.name, one.name) in _TRANSFERS
        )


def routine_at(
    begin: int,
    instructions: Mapping[int, Instruction],
    skipped_to: Callable[[Instruction], int],
) -> Routine | None:
    """The routine that begins at an address, or None if that is not a known one."""
    known = ROUTINES.get(_begin(begin, instructions))
    if known is None:
        return None
    shape = shape_of(begin, instructions, skipped_to)
    name = None if shape is None else known.get(shape.digest)
    if shape is None or name is None:
        return None
    addresses = frozenset(one.address for one in shape.order)
    pushed = frozenset(one.d for one in shape.order if one.name == "push")
    return Routine(name, shape.sites(), addresses, pushed)


def shape_of(
    begin: int,
    instructions: Mapping[int, Instruction],
    skipped_to: Callable[[Instruction], int],
) -> Shape | None:
    """The shape of the routine at an address; None if it is too long or leads beyond code."""
    order: dict[int, Instruction] = {}
    open_ends = deque([begin])
    while open_ends:
        at = open_ends.popleft()
        while at not in order:
            one = instructions.get(at)
            if one is None or one.name in _NEVER or len(order) == _MOST_INSTRUCTIONS:
                return None
            order[at] = one
            open_ends += _targets(one, skipped_to)
            if _SHORT.get(one.name, one.name) in _ENDS:
                break
            at = one.end
    numbers = {at: number for number, at in enumerate(order)}
    digest = hashlib.sha256()
    for one in order.values():
        led_to = [numbers[at] for at in _targets(one, skipped_to)]
        # The next instruction is not always the next one of this order.
        name = _SHORT.get(one.name, one.name)
        behind = -1 if name in _ENDS else numbers[one.end]
        digest.update(repr((name, one.d, one.r, one.k, led_to, behind)).encode())
    return Shape(digest.hexdigest()[:_DIGEST_CHARACTERS], tuple(order.values()))


def _begin(at: int, instructions: Mapping[int, Instruction]) -> tuple[str, ...]:
    names: list[str] = []
    while len(names) < _BEGINS and (one := instructions.get(at)) is not None:
        names.append(_SHORT.get(one.name, one.name))
        at = one.end
    return tuple(names)


def _targets(one: Instruction, skipped_to: Callable[[Instruction], int]) -> list[int]:
    if one.name in _SHORT or one.name in _TRANSFERS or one.name in _BRANCHES:
        return [one.target]
    return [skipped_to(one)] if one.name in SKIPS else []
