"""Loops of machine code whose turns can be left out, all but the last: that one sets registers and
flags as it does. A hack for speed alone; code that is marked for coverage executes each turn, and
is what tests hold these against.

Three kinds are known, by their instructions: counters that go down to 0, as compilers make delays;
the restoring divisions of libgcc and avr-libc, a bit of the quotient in each turn, which one
division of this computer does at once; and shifts to the left until the highest bit is set, by
which numbers become floats. Each is left out as far as cycles go before the next interrupt
(emulator/robots/translated/passes/loops.h).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from kilotwin.programs.translate.instructions import Instruction
from kilotwin.programs.translate.statements import Z, cycles

_MOST_BYTES = 4  # of a number
_BYTE = 8
_C, _N = 0, 2  # flags, as brbs and brbc name them


def turns_left_out(begin: int, instructions: Mapping[int, Instruction]) -> str | None:
    """The statement that leaves turns out of the loop that begins at an address, or None if it
    begins no such loop; `instructions` are those of the region, by address."""
    return (
        _countdown(_Reader(instructions, begin))
        or _normalisation(_Reader(instructions, begin))
        or _division(_Reader(instructions, begin))
    )


def divisor(begin: int, instructions: Mapping[int, Instruction]) -> str | None:
    """The number by which the loop divides that begins at an address, or None if none does."""
    found = _parts_of_division(_Reader(instructions, begin))
    return None if found is None else found.divisor


def _number(registers: list[int]) -> str:
    """The lowest byte first."""
    parts = (f"(uint32_t)r{register} << {_BYTE * at}" for at, register in enumerate(registers))
    return " | ".join(parts)


def _set(registers: list[int], value: str) -> str:
    bytes_ = (
        f"r{register} = (uint8_t)({value} >> {_BYTE * at});"
        for at, register in enumerate(registers)
    )
    return " ".join(bytes_)


@dataclass
class _Reader:
    """Takes instructions one after the other. Code may lead into their midst: turns are left out
    where one begins, also if code has led there from elsewhere."""

    instructions: Mapping[int, Instruction]
    begin: int
    """Address of the first."""
    at: int = field(init=False)
    cycles: int = 0
    """Sum over those taken; branches as if they were not taken."""

    def __post_init__(self) -> None:
        self.at = self.begin

    def take(self, *names: str) -> Instruction | None:
        """The next one, if it is one of these."""
        instruction = self.instructions.get(self.at)
        if instruction is None or instruction.name not in names:
            return None
        self.at = instruction.end
        self.cycles += cycles(instruction)
        return instruction

    def chain(self, first: str, others: str) -> list[Instruction]:
        """An operation on a number, byte by byte with the carry; empty if there is none."""
        taken: list[Instruction] = []
        while more := self.take(others if taken else first):
            taken.append(more)
        return taken

    def shift(self, first: str) -> list[int]:
        """Registers of a number that is added to itself: one place to the left."""
        chain = self.chain(first, "adc")
        return [step.d for step in chain] if all(step.d == step.r for step in chain) else []

    def count(self) -> list[int]:
        """Registers of a counter that goes down by 1."""
        if word := self.take("sbiw"):
            return [word.d, word.d + 1] if word.k == 1 else []
        if byte := self.take("dec"):
            return [byte.d]
        chain = self.chain("subi", "sbci")
        steps = [step.k for step in chain]
        return [step.d for step in chain] if steps == [1] + [0] * (len(chain) - 1) else []

    def goes_back_unless(self, flag: int) -> bool:
        """By the branch that the loop ends with."""
        branch = self.take("brbc")
        return branch is not None and branch.k == flag and branch.target == self.begin


def _are_numbers(*numbers: list[int]) -> bool:
    """Whether they are of few bytes, and no two of the same."""
    registers = [register for number in numbers for register in number]
    sizes = {len(number) for number in numbers}
    return min(sizes) > 0 and max(sizes) <= _MOST_BYTES and len(set(registers)) == len(registers)


def _countdown(reader: _Reader) -> str | None:
    """Nothing but a counter."""
    counter = reader.count()
    if not _are_numbers(counter) or not reader.goes_back_unless(Z):
        return None
    turn = reader.cycles + 1
    return f"COUNT_DOWN({_number(counter)}, {_BYTE * len(counter)}, {turn}, {_set(counter, 'n_')})"


def _normalisation(reader: _Reader) -> str | None:
    """A number goes to the left, and a counter down, until the highest bit is set."""
    counter, number = reader.count(), reader.shift("add")
    if not _are_numbers(counter, number) or not reader.goes_back_unless(_N):
        return None
    return (
        f"NORMALISE({_number(number)}, {_BYTE * len(number)}, {reader.cycles + 1}, "
        f"{_number(counter)}, {_set(number, 'v_')} {_set(counter, 'n_')})"
    )


@dataclass(frozen=True)
class _Division:
    divisor: str
    statement: str


def _division(reader: _Reader) -> str | None:
    found = _parts_of_division(reader)
    return None if found is None else found.statement


def _parts_of_division(reader: _Reader) -> _Division | None:
    """The rest is shifted, the divisor taken from it where it is not less, and what that comes to
    shifted into the quotient, inverted. It ends by a counter, while the dividend's bits come out
    of the quotient's registers; or, with no more bits to come, when the mark is shifted out that
    the quotient began with."""
    rest = reader.shift("adc")
    by_mark = not rest
    if by_mark:
        rest = reader.shift("add")
    compared = reader.chain("cp", "cpc")
    skip = reader.take("brbs")
    skipping = reader.cycles + 1
    taken = reader.chain("sub", "sbc")
    subtracting = reader.cycles
    dividing = [step.r for step in compared]
    pairs = [(step.d, step.r) for step in compared]
    if rest != [step.d for step in compared] or pairs != [(step.d, step.r) for step in taken]:
        return None
    if skip is None or skip.k != _C or skip.target != reader.at:
        return None
    quotient = reader.shift("adc")
    count = None if by_mark else reader.take("dec")
    numbers = [rest, dividing, quotient, *([] if count is None else [[count.d]])]
    ends = (
        _are_numbers(*numbers)
        and (count is None) == by_mark
        and len(quotient) == (1 if by_mark else len(rest))
        and reader.goes_back_unless(_C if by_mark else Z)
    )
    if not ends:
        return None
    end = reader.cycles - subtracting + 1
    arguments = [*map(_number, numbers[:3])]
    if count is not None:
        arguments.append(f"r{count.d}")
    arguments += map(str, [_BYTE * len(rest), subtracting + end, skipping + end])
    arguments.append(f"{_set(rest, 'rest_')} {_set(quotient, 'bits_')}")
    kind = "TO_MARK" if by_mark else "BY_COUNT"
    return _Division(_number(dividing), f"DIVIDE_{kind}({', '.join(arguments)})")
