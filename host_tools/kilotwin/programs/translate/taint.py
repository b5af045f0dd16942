"""Parts of a variable in registers and flags while code runs: bytes of the variable and constants
added to it, and comparisons of them (counters.py follows code by it)."""

from dataclasses import dataclass, replace

from kilotwin.programs.translate.instructions import Instruction
from kilotwin.programs.translate.registers import SCRATCH, registers_changed, registers_read
from kilotwin.programs.translate.statements import REGISTERS

Bound = tuple[int, int]
"""Bits and a number: something about a variable, modulo 2^bits, may change from the number before
to this one."""

_BYTE, _BYTE_MASK = 8, 0xFF
_C, _Z, _N, _V, _S, _T, _I = 0, 1, 2, 3, 4, 6, 7
_SREG = 0x5F
_ZERO_REGISTER = 1  # avr-gcc's
_SUMS = {"add", "adc", "sub", "subi", "sbc", "sbci", "cp", "cpi", "cpc"}
_ADDS, _WITH_CARRY = {"add", "adc"}, {"adc", "sbc", "sbci", "cpc"}
_IMMEDIATE, _COMPARES = {"subi", "sbci", "cpi"}, {"cp", "cpi", "cpc"}
_BRANCHES = {"brbs", "brbc"}
_BIT_SKIPS = {"sbrc", "sbrs"}


class UnknownError(Exception):
    """More is done with a variable than is known here."""


@dataclass(frozen=True)
class Part:
    """Bytes `low` to `high` of a variable and what was added to it, of which no more than `bits`
    count; of more than one byte it is known only whether all are 0."""

    base: int
    """Address of the load that it comes from."""
    low: int
    high: int
    offset: int
    """Constants added, modulo 2 ^ (8 * (high + 1))."""
    addends: tuple[int, ...]
    """Addresses of additions of other numbers, which do not change from pass to pass."""
    bits: int

    @staticmethod
    def of(base: int, byte: int) -> "Part":
        """A byte as it is loaded."""
        return Part(base, byte, byte, 0, (), _BYTE * (byte + 1))

    def is_byte(self, byte: int) -> bool:
        """Whether it is that byte, all of it."""
        return self.low == self.high == byte and self.bits == _BYTE * (byte + 1)

    def agrees(self, lower: "Part") -> bool:
        """Whether it goes on where another one, of lower bytes, ends."""
        mask = (1 << _BYTE * self.low) - 1
        return (
            (self.base, self.addends) == (lower.base, lower.addends)
            and self.low == lower.high + 1
            and (self.offset ^ lower.offset) & mask == 0
        )


@dataclass(frozen=True)
class ByteComparison:
    """Flags by a part minus `k`, or plus minus k if it is a sum."""

    part: Part
    k: int
    is_sum: bool = False
    addend: int | None = None
    """Address of the addition, if what was added is no constant."""

    def bounds(self, flag: int) -> set[tuple[int, Bound]]:
        """Bounds that a flag depends on, with the number of the load.

        UnknownError if they depend on more than constants.
        """
        part, k = self.part, self.k
        if part.addends or self.addend is not None or flag not in (_C, _Z, _N, _V, _S):
            raise UnknownError
        half = 1 << (part.bits - 1)
        at = {
            _C: (k, 0),
            _Z: (k, k + (1 << _BYTE * part.low)),
            _N: (k, k + half),
            _S: (k, half),
            _V: (k, k + half, half),
        }[flag]
        return {(part.base, (part.bits, (one - part.offset) & _ones(part.bits))) for one in at}


class _Poison:
    """Something that depends on a variable in another way."""


_POISON = _Poison()
_Value = Part | _Poison | int
_Flag = ByteComparison | _Poison


class State:
    """Constants in registers, and what comes from variables in registers and flags."""

    def __init__(self) -> None:
        self._registers: dict[int, _Value] = {_ZERO_REGISTER: 0}
        self._flags: dict[int, _Flag] = {}

    def copy(self) -> "State":
        """One that may be changed."""
        other = State()
        other._registers, other._flags = dict(self._registers), dict(self._flags)
        return other

    def key(self) -> object:
        """Equal for equal states."""
        return frozenset(self._registers.items()), frozenset(self._flags.items())

    @property
    def is_tainted(self) -> bool:
        """Whether anything comes from a variable."""
        return bool(self._flags) or any(
            not isinstance(value, int) for value in self._registers.values()
        )

    def load(self, register: int, part: Part) -> None:
        """A variable's byte is loaded."""
        self._registers[register] = part

    def part(self, register: int) -> Part | None:
        """The part of a variable that a register has, None if it has none.

        UnknownError if that is known to no more than that.
        """
        value = self._registers.get(register)
        if isinstance(value, _Poison):
            raise UnknownError
        return value if isinstance(value, Part) else None

    def forget(self, registers: int, flags: int) -> None:
        """Keeps what may be read: bits by number."""
        for register in [at for at in self._registers if not registers >> at & 1]:
            if register != _ZERO_REGISTER:
                del self._registers[register]
        self._flags = {flag: value for flag, value in self._flags.items() if flags >> flag & 1}

    def call(self, live: int, *, follows: bool) -> None:
        """A function is called, by the calling convention or not; it may read `live`, or what is
        behind it may."""
        for register, value in [*self._registers.items()]:
            if not isinstance(value, int) and live >> register & 1:
                raise UnknownError
            keeps = follows and not SCRATCH >> register & 1
            if not keeps and register != _ZERO_REGISTER:
                del self._registers[register]
        self._flags = {}

    def leave(self) -> None:
        """A function returns that follows the calling convention: no flag is read behind it."""
        self._flags = {}

    def execute(self, instruction: Instruction) -> set[tuple[int, Bound]]:
        """An instruction that neither leads elsewhere nor has to do with a variable; what it gives
        is bounds that it depends on, with the number of the load.

        UnknownError if it depends on a variable in another way.
        """
        name = instruction.name
        if name in _SUMS:
            return self._sum(instruction)
        if name in ("adiw", "sbiw"):
            return self._word_sum(instruction)
        if name in ("inc", "dec"):
            return self._count(instruction)
        if name in ("mov", "movw"):
            return self._copy(instruction)
        if name in ("and", "andi", "or"):
            return self._logic(instruction)
        if name in _BRANCHES:
            return self._ask(instruction.k)
        if name in _BIT_SKIPS or name == "bst":
            return self._ask_bit(instruction)
        if name == "cpse":
            return self._ask_equal(instruction)
        return self._other(instruction)

    # By kind

    def _other(self, instruction: Instruction) -> set[tuple[int, Bound]]:
        """An instruction without a meaning here: if it reads such bytes its results are known no
        more, and where these lead out of the registers nothing is known."""
        name, bounds = instruction.name, set[tuple[int, Bound]]()
        reads = self._tainted(registers_read(instruction))
        changed = registers_changed(instruction)
        if name == "ror":
            bounds = self._ask(_C)
        if name in ("in", "lds") and instruction.k == _SREG and self._flags:
            raise UnknownError
        if name in ("bset", "bclr"):
            self._flags.pop(instruction.k, None)
        if reads and (not changed or name.startswith(("ld", "-ld", "st", "-st", "lpm"))):
            raise UnknownError
        for register in range(REGISTERS):
            if changed >> register & 1:
                self._registers.pop(register, None)
                if reads:
                    self._registers[register] = _POISON
        if name == "ldi":
            self._registers[instruction.d] = instruction.k
        if name == "eor" and instruction.d == instruction.r:
            self._registers[instruction.d] = 0
        sets_flags = name not in ("ldi", "swap", "bld", "in", "pop", "push", "nop", "bset", "bclr")
        if sets_flags and (changed or name in ("out", "sts")):
            self._set_flags(instruction, _POISON if reads else None)
        return bounds

    def _set_flags(self, instruction: Instruction, value: _Flag | None) -> None:
        """All that such an instruction sets."""
        name = instruction.name
        if name.startswith(("ld", "-ld", "st", "-st", "lpm")) or name in ("out", "sts"):
            if name in ("out", "sts") and instruction.k == _SREG:
                self._flags = {}
            return
        kept = (_C,) if name == "eor" else ()
        for flag in (_C, _Z, _N, _V, _S):
            if flag not in kept:
                self._set_flag(flag, value)

    def _set_flag(self, flag: int, value: _Flag | None) -> None:
        if value is None:
            self._flags.pop(flag, None)
        else:
            self._flags[flag] = value

    def _tainted(self, registers: int) -> bool:
        return any(
            registers >> at & 1 and not isinstance(value, int)
            for at, value in self._registers.items()
        )

    def _copy(self, instruction: Instruction) -> set[tuple[int, Bound]]:
        words = 2 if instruction.name == "movw" else 1
        values = [self._registers.get(instruction.r + at) for at in range(words)]
        for at, value in enumerate(values):
            self._put(instruction.d + at, value)
        return set()

    def _put(self, register: int, value: _Value | None) -> None:
        if value is None:
            self._registers.pop(register, None)
        else:
            self._registers[register] = value

    def _ask(self, flag: int) -> set[tuple[int, Bound]]:
        """A flag is read: it stays what it is as long as the variable keeps to the bounds."""
        value = self._flags.get(flag)
        if isinstance(value, _Poison):
            raise UnknownError
        return set() if value is None else value.bounds(flag)

    def _ask_bit(self, instruction: Instruction) -> set[tuple[int, Bound]]:
        part = self.part(instruction.d)
        if part is None:
            return set()
        bits = _BYTE * part.low + instruction.k + 1
        if part.low != part.high or part.addends or bits > part.bits:
            raise UnknownError
        return {
            (part.base, (bits, (at - part.offset) & ((1 << bits) - 1)))
            for at in (0, 1 << (bits - 1))
        }

    def _ask_equal(self, instruction: Instruction) -> set[tuple[int, Bound]]:
        a, b = self._registers.get(instruction.d), self._registers.get(instruction.r)
        if isinstance(a, int) and isinstance(b, Part):
            a, b = b, a
        if isinstance(a, Part) and isinstance(b, int) and a.low == a.high:
            return ByteComparison(a, b << _BYTE * a.low).bounds(_Z)
        if isinstance(a, Part | _Poison) or isinstance(b, Part | _Poison):
            raise UnknownError
        return set()

    def _logic(self, instruction: Instruction) -> set[tuple[int, Bound]]:
        """Masks of low bits, and bytes together compared with 0; C stays."""
        name, d = instruction.name, instruction.d
        a = self._registers.get(d)
        b = instruction.k if name == "andi" else self._registers.get(instruction.r)
        bounds = set[tuple[int, Bound]]()
        result: _Value | None = None
        if isinstance(a, Part) and a == b:
            result = a
        elif name != "or" and isinstance(a, int) and isinstance(b, Part):
            result, bounds = _masked(b, a)
        elif name != "or" and isinstance(a, Part) and isinstance(b, int):
            result, bounds = _masked(a, b)
        elif name == "or" and isinstance(a, Part) and isinstance(b, Part):
            result = _together(a, b)
        elif isinstance(a, Part | _Poison) or isinstance(b, Part | _Poison):
            result = _POISON
        self._put(d, result)
        flag: _Flag | None = None
        if isinstance(result, Part):
            flag = ByteComparison(result, 0)
        elif isinstance(result, _Poison):
            flag = _POISON
        self._set_flag(_Z, flag)
        is_byte = isinstance(result, Part) and result.is_byte(result.low)
        for which in (_N, _V, _S):
            self._set_flag(which, flag if flag is None or is_byte else _POISON)
        return bounds

    # Sums

    def _sum(self, instruction: Instruction) -> set[tuple[int, Bound]]:
        name, d = instruction.name, instruction.d
        operand = instruction.k if name in _IMMEDIATE else self._registers.get(instruction.r)
        if name == "sub" and d == instruction.r:
            operand = None
            self._registers.pop(d, None)
        return self._add(
            d,
            operand,
            at=instruction.address,
            is_sum=name in _ADDS,
            takes_carry=name in _WITH_CARRY,
            keeps=name not in _COMPARES,
        )

    def _word_sum(self, instruction: Instruction) -> set[tuple[int, Bound]]:
        d, is_sum = instruction.d, instruction.name == "adiw"
        at = instruction.address
        bounds = self._add(d, instruction.k, at, is_sum=is_sum, takes_carry=False, keeps=True)
        low = self._flags.get(_C)
        bounds |= self._add(d + 1, 0, at, is_sum=is_sum, takes_carry=True, keeps=True)
        if is_sum and isinstance(low, ByteComparison) and _C in self._flags:
            self._flags[_Z] = self._flags[_C]  # of both bytes
        return bounds

    def _count(self, instruction: Instruction) -> set[tuple[int, Bound]]:
        """C stays."""
        carry = self._flags.get(_C)
        is_sum = instruction.name == "inc"
        at = instruction.address
        bounds = self._add(instruction.d, 1, at, is_sum=is_sum, takes_carry=False, keeps=True)
        self._set_flag(_C, carry)
        return bounds

    def _add(
        self,
        d: int,
        operand: _Value | None,
        at: int,
        *,
        is_sum: bool,
        takes_carry: bool,
        keeps: bool,
    ) -> set[tuple[int, Bound]]:
        """An addition, difference or comparison of a byte; None is a byte of no variable."""
        a = self._registers.get(d)
        if is_sum and isinstance(operand, Part) and not isinstance(a, Part | _Poison):
            a, operand = operand, a
        carry = self._flags.get(_C) if takes_carry else None
        bounds = set[tuple[int, Bound]]()
        sum_: ByteComparison | None = None
        is_tainted = isinstance(a, Part | _Poison) or isinstance(operand, Part | _Poison)
        if isinstance(a, Part) and not isinstance(operand, Part | _Poison) and a.low == a.high:
            sum_ = _compared(a, operand, carry, at, is_sum=is_sum, takes_carry=takes_carry)
        if sum_ is None and takes_carry:
            bounds |= self._ask(_C)  # what becomes of it depends on the carry alone
            if not is_sum:
                bounds |= self._ask(_Z)
        result: _Value | None = None
        if sum_ is not None and isinstance(a, Part):
            result = _result(a, sum_)
        elif is_tainted:
            result = _POISON
        self._note_sum(sum_, is_tainted=is_tainted, result=result)
        if keeps:
            self._put(d, result)
        return bounds

    def _note_sum(
        self, sum_: ByteComparison | None, *, is_tainted: bool, result: _Value | None
    ) -> None:
        """The flags of one: of a difference of several bytes Z is of all, of a sum of the last."""
        flag = sum_ if sum_ is not None else (_POISON if is_tainted else None)
        is_of_all = self._flags.get(_Z) == self._flags.get(_C)
        for which in (_C, _Z, _N, _V, _S):
            self._set_flag(which, flag)
        if sum_ is None:
            return
        part = sum_.part
        if part.bits != _BYTE * (part.high + 1):
            self._flags.update(dict.fromkeys((_N, _V, _S), _POISON))
        if sum_.is_sum:
            self._flags[_Z] = ByteComparison(result, 0) if isinstance(result, Part) else _POISON
        elif part.high > part.low and not is_of_all:
            self._flags[_Z] = _POISON


def _masked(part: Part, mask: int) -> tuple[_Value | None, set[tuple[int, Bound]]]:
    """A byte and a mask: low bits are known, higher ones until they change."""
    if part.low != part.high or part.addends:
        return _POISON, set()
    mask &= (1 << (part.bits - _BYTE * part.low)) - 1
    if mask == 0:
        return 0, set()
    if mask & (mask + 1) == 0:
        return replace(part, bits=_BYTE * part.low + mask.bit_length()), set()
    still = _BYTE * part.low + (mask & -mask).bit_length() - 1
    if still == 0:
        return _POISON, set()
    return None, {(part.base, (still, -part.offset & ((1 << still) - 1)))}


def _together(a: Part, b: Part) -> _Value:
    low, high = sorted((a, b), key=lambda part: part.low)
    if not high.agrees(low) or low.bits != _BYTE * (low.high + 1):
        return _POISON
    return replace(high, low=low.low)


def _compared(
    a: Part,
    operand: int | None,
    carry: _Flag | None,
    at: int,
    *,
    is_sum: bool,
    takes_carry: bool,
) -> ByteComparison | None:
    """A byte and another one, behind those that the carry comes from; None if these are none of
    the same number."""
    shifted = (operand or 0) << _BYTE * a.low
    addend = at if operand is None else None
    if not takes_carry:
        return ByteComparison(a, -shifted & _ones(a.bits) if is_sum else shifted, is_sum, addend)
    if not isinstance(carry, ByteComparison) or carry.is_sum != is_sum or not a.agrees(carry.part):
        return None
    if carry.part.bits != _BYTE * a.low:
        return None
    k = carry.k + shifted
    if is_sum:  # what is known of the lower bytes is so modulo their size
        k = -((-carry.k & _ones(carry.part.bits)) + shifted) & _ones(a.bits)
    first = carry.addend if carry.addend is not None else addend
    return ByteComparison(replace(a, low=carry.part.low), k, is_sum, first)


def _ones(bits: int) -> int:
    return (1 << bits) - 1


def _result(a: Part, sum_: ByteComparison) -> _Value:
    """The byte of a sum or difference."""
    if a.bits != _BYTE * (a.high + 1):
        return _POISON
    if sum_.addend is not None:
        return replace(a, addends=(*a.addends, sum_.addend))
    return replace(a, offset=(a.offset - sum_.k) & _ones(a.bits))
