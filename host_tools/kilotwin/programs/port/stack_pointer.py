"""Where the stack pointer is, followed from instruction to instruction through registers.

A frame is made by way of registers: the stack pointer is read, a number taken off, and the result
written back. Of a register is known what matters to that: a number, or half of a stack pointer.
"""

from dataclasses import dataclass, field, replace
from enum import Enum

from kilotwin.programs.port.disassembly import Instruction

_SPL, _SPH, _SREG = "0x3d", "0x3e", "0x3f"
_ZERO = "r1"  # holds 0 wherever C code runs
_CALL_CLOBBERED = tuple(f"r{number}" for number in (0, *range(18, 28), 30, 31))
_Z = ("r30", "r31")
_PAIR_ARITHMETIC = {"adiw": -1, "sbiw": 1}
_LOW_ARITHMETIC = {"add": -1, "sub": 1, "subi": 1}
_HIGH_ARITHMETIC = {"adc": -1, "sbc": 1, "sbci": 1}
_LOADS = {"ld", "ldd", "lds", "pop"}
_PRODUCTS = {"mul", "muls", "mulsu", "fmul", "fmuls", "fmulsu"}
# Their first operand may be a register, and is only read.
_READS_FIRST = {"cp", "cpc", "cpi", "cpse", "sbrc", "sbrs", "bst", *_PRODUCTS}
_POINTERS = {"X": 26, "Y": 28, "Z": 30}
_KEEPS_CARRY = {"mov", "movw", "ldi", "in", "cli", "push", "nop", *_LOADS}


class Half(Enum):
    """Half of an address."""

    LOW = 0
    HIGH = 1


@dataclass(frozen=True)
class Below:
    """Half of the stack pointer as it was before the call, less `bytes`; of LOW modulo 256."""

    half: Half
    bytes: int


class _Stored(Enum):
    STORED = "read from memory"


STORED = _Stored.STORED

Value = int | Below | _Stored
"""Value of a register, where it is known."""


class UnknownStackPointerError(Exception):
    """The stack pointer is written with something that is computed at run time."""


@dataclass(frozen=True)
class State:
    """Before an instruction. `depth`: bytes below the stack pointer as it was before the call."""

    depth: int
    registers: dict[str, Value] = field(default_factory=lambda: {_ZERO: 0})
    restored: bool = False
    """The stack pointer has been read from memory, as by longjmp(): it is a caller's by now."""
    _carry: tuple[int, int, int] | None = None
    """Change of a LOW half: which, the number, and whether it was added or taken off."""
    _high: Value | None = None
    """The value written to SPH: SPL follows."""

    def after(self, instruction: Instruction) -> "State":
        """Bytes that it leaves behind, calls aside; UnknownStackPointerError."""
        name, operands = instruction.name, instruction.operands.split(", ")
        if name == "push":
            return replace(self, depth=self.depth + 1)
        if name == "out":
            return self._written(operands[0], self.registers.get(operands[1]))
        registers = dict(self.registers)
        carry = self._carry if name in _KEEPS_CARRY else None
        destination = operands[0]
        if name == "movw":
            _put(registers, destination, self.registers.get(operands[1]))
            _put(registers, _next(destination), self.registers.get(_next(operands[1])))
        elif name in _PAIR_ARITHMETIC:
            self._add_to_pair(registers, destination, _PAIR_ARITHMETIC[name] * int(operands[1], 16))
        elif name in _LOW_ARITHMETIC:
            carry = self._add_low(registers, destination, operands[1], _LOW_ARITHMETIC[name])
        elif name in _HIGH_ARITHMETIC:
            self._add_high(registers, destination, operands[1], _HIGH_ARITHMETIC[name])
        else:
            for register in _written_beside(name, operands):
                registers.pop(register, None)
            if name not in _READS_FIRST:
                _put(registers, destination, self._plain(name, operands))
        return replace(self, depth=self.depth - (name == "pop"), registers=registers, _carry=carry)

    def after_call(self) -> "State":
        """Registers after a function that keeps to the rules for calls."""
        kept = {
            register: value
            for register, value in self.registers.items()
            if register not in _CALL_CLOBBERED
        }
        return replace(self, registers=kept | {_ZERO: 0}, _carry=None)

    def joined(self, other: "State") -> "State":
        """Knowledge where either may be, with the deeper one's depth."""
        return State(
            max(self.depth, other.depth),
            {
                register: value
                for register, value in self.registers.items()
                if other.registers.get(register) == value
            },
            self.restored and other.restored,
            self._carry if self._carry == other._carry else None,
            self._high if self._high == other._high else None,
        )

    @property
    def z(self) -> int | None:
        """The byte address that Z, with a word address, leads to; None: not known."""
        low, high = (self.registers.get(register) for register in _Z)
        return 2 * (low + 256 * high) if isinstance(low, int) and isinstance(high, int) else None

    def _value(self, operand: str) -> Value | None:
        return int(operand, 16) if operand.startswith("0x") else self.registers.get(operand)

    def _plain(self, name: str, operands: list[str]) -> Value | None:
        """Value that an instruction without arithmetic puts into its first operand."""
        if name == "in" and operands[1] in (_SPL, _SPH):
            low = operands[1] == _SPL
            return Below(Half.LOW, self.depth % 256) if low else Below(Half.HIGH, self.depth)
        if name in ("mov", "ldi"):
            return self._value(operands[1])
        if name == "eor" and operands[0] == operands[1]:
            return 0
        return STORED if name in _LOADS else None

    def _written(self, port: str, value: Value | None) -> "State":
        """SPH is written first, with interrupts off."""
        if port == _SPH:
            return replace(self, _high=value)
        if port != _SPL:
            return replace(self, _carry=None) if port == _SREG else self
        high = self._high
        if value is STORED and high is STORED:
            return replace(self, restored=True)
        depth = _together(value, high)
        if depth is not None:
            return replace(self, depth=depth, _high=None)
        raise UnknownStackPointerError

    def _add_to_pair(self, registers: dict[str, Value], first: str, number: int) -> None:
        below = _together(self.registers.get(first), self.registers.get(_next(first)))
        if below is None:
            registers.pop(first, None)
            registers.pop(_next(first), None)
        else:
            below = _signed(below + number)
            registers[first] = Below(Half.LOW, below % 256)
            registers[_next(first)] = Below(Half.HIGH, below)

    def _add_low(
        self, registers: dict[str, Value], first: str, second: str, sign: int
    ) -> tuple[int, int, int] | None:
        value, number = self.registers.get(first), self._value(second)
        if isinstance(value, Below) and value.half is Half.LOW and isinstance(number, int):
            registers[first] = Below(Half.LOW, (value.bytes + sign * number) % 256)
            return value.bytes, number, sign
        registers.pop(first, None)
        return None

    def _add_high(self, registers: dict[str, Value], first: str, second: str, sign: int) -> None:
        value, number = self.registers.get(first), self._value(second)
        if (
            isinstance(value, Below)
            and value.half is Half.HIGH
            and isinstance(number, int)
            and self._carry is not None
            and self._carry[2] == sign
            and self._carry[0] == value.bytes % 256
        ):
            below = _signed(value.bytes + sign * (self._carry[1] + 256 * number))
            registers[first] = Below(Half.HIGH, below)
        else:
            registers.pop(first, None)


def _together(low: Value | None, high: Value | None) -> int | None:
    """Depth from both halves of one stack pointer: bytes below that before the call."""
    if not isinstance(low, Below) or not isinstance(high, Below):
        return None
    halves = low.half is Half.LOW and high.half is Half.HIGH
    return high.bytes if halves and low.bytes == high.bytes % 256 else None


def _written_beside(name: str, operands: list[str]) -> list[str]:
    """Registers that it writes and that are not its first operand."""
    if name in _PRODUCTS or (name == "lpm" and operands == [""]):
        return ["r0", "r1"]
    return [
        f"r{number + half}"
        for pointer, number in _POINTERS.items()
        for half in (0, 1)
        if f"{pointer}+" in operands or f"-{pointer}" in operands
    ]


def _next(register: str) -> str:
    return f"r{int(register[1:]) + 1}"


def _put(registers: dict[str, Value], register: str, value: Value | None) -> None:
    if value is None:
        registers.pop(register, None)
    else:
        registers[register] = value


def _signed(number: int) -> int:
    """A number of 16 bits with its sign."""
    return (number + 0x8000) % 0x10000 - 0x8000
