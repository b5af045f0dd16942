"""Constants of a program: numbers that its machine code loads, and compares, adds or subtracts."""

from collections.abc import Iterator, Sequence

from kilotwin.programs.translate.instructions import Instruction, decode

_MOST_BYTES = 4
_MOST_BETWEEN = 10
"""Instructions that an operation on a number of four bytes takes, with loads between them."""
_FIRST = ("cpi", "subi", "ldi")
_JUMPS = {"jmp", "rjmp", "call", "rcall", "ret", "brbs", "brbc"}
_ZERO = 1  # the register that avr-gcc keeps at 0


def constants_in(flash: bytes, extents: Sequence[tuple[int, int]]) -> set[int]:
    """Those above 1 of code at these byte addresses, of one, two and four bytes; what is subtracted
    also as what that adds. Bytes that belong to a larger number count as well. Time O(bytes)."""
    found: set[int] = set()
    for begin, end in extents:
        code = list(_instructions(flash, begin, end))
        for at, instruction in enumerate(code):
            if instruction.name in _FIRST:
                found.update(_numbers(instruction, code[at + 1 : at + 1 + _MOST_BETWEEN]))
    return {number for number in found if number > 1}


def _instructions(flash: bytes, begin: int, end: int) -> Iterator[Instruction]:
    at = begin
    while at < end:
        instruction = decode(flash, at)
        yield instruction
        at = instruction.end


def _numbers(first: Instruction, others: Sequence[Instruction]) -> Iterator[int]:
    """The number that begins with the first one's constant, at each of its possible lengths."""
    bytes_ = [first.k]
    loaded: dict[int, int] = {_ZERO: 0}
    for other in others:
        if len(bytes_) == _MOST_BYTES or other.name in _JUMPS:
            break
        is_next = other.d == first.d + len(bytes_)
        if first.name == "ldi" and other.name == "ldi" and is_next:
            bytes_.append(other.k)
        elif other.name == "ldi":
            loaded[other.d] = other.k
        elif first.name == "ldi":
            continue
        elif other.name == "sbci" and is_next:
            bytes_.append(other.k)
        elif other.name == "cpc" and is_next and other.r in loaded:
            bytes_.append(loaded[other.r])
    for length in (1, 2, 4):
        if length <= len(bytes_):
            number = int.from_bytes(bytes(bytes_[:length]), "little")
            yield number
            if first.name == "subi":
                yield (1 << 8 * length) - number
