"""Registers that an ATmega328P's instructions read and change, and those that a function's
instructions may still read (the calling convention is avr-gcc's)."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from kilotwin.programs.translate.instructions import Instruction
from kilotwin.programs.translate.liveness import followers, live_after

ALL_REGISTERS = 0xFFFFFFFF
_X, _Y, _Z = (3 << low for low in (26, 28, 30))
_PRODUCT = 3 << 0
_RESULTS = 0xFF << 18
SCRATCH = 1 << 0 | 0x3FF << 18 | _Z
"""Those that a function may change."""
_KEPT = ALL_REGISTERS & ~SCRATCH

_READ_BOTH = {"cp", "cpc", "cpse", "add", "adc", "sub", "sbc", "and", "or", "eor"}
_MULTIPLY = {"mul", "muls", "mulsu", "fmul", "fmuls", "fmulsu"}
_CHANGE = {
    *("subi", "sbci", "ori", "andi", "com", "neg", "swap", "inc", "dec", "asr", "lsr", "ror"),
    "bld",
}
_READ = {"cpi", "bst", "sbrc", "sbrs", "sts", "out", "push"}
_COMPARE = {"cp", "cpc", "cpse"}
_LOADS = {"ld", "ld+", "-ld", "ldd"}
_STORES = {"st", "st+", "-st", "std"}
_ONLY_WRITE = {"lds", "in", "pop", "ldi", "lpm", "lpm+"}
_NOTHING = {
    *("nop", "bset", "bclr", "brbs", "brbc", "sbi", "cbi", "sbic", "sbis", "sleep", "break", "wdr"),
    *("jmp", "rjmp", "call", "rcall", "ret", "reti"),
}


def registers_read(instruction: Instruction) -> int:
    """As bits by number."""
    name, d, r = instruction.name, 1 << instruction.d, 1 << instruction.r
    if name in ("eor", "sub") and d == r:
        return 0  # it is 0 afterwards, whatever it was
    if name in _READ_BOTH | _MULTIPLY:
        return d | r
    if name in _CHANGE | _READ:
        return d
    if name in ("adiw", "sbiw"):
        return d | d << 1
    if name in ("mov", "movw"):
        return r | r << 1 if name == "movw" else r
    if name in _LOADS:
        return r | r << 1
    if name in _STORES:
        return d | r | r << 1
    if name in ("lpm", "lpm+", "lpm_r0", "ijmp", "icall"):
        return _Z
    return 0 if name in _NOTHING | _ONLY_WRITE else ALL_REGISTERS


def registers_changed(instruction: Instruction) -> int:
    """As bits by number, without what a function changes that it calls."""
    name, d = instruction.name, 1 << instruction.d
    changed = 0
    if name in _MULTIPLY:
        changed = _PRODUCT
    elif name == "lpm_r0":
        changed = 1
    elif name in ("adiw", "sbiw", "movw"):
        changed = d | d << 1
    elif name in (_READ_BOTH - _COMPARE) | _CHANGE | _LOADS | _ONLY_WRITE | {"mov"}:
        changed = d
    if name in ("ld+", "-ld", "st+", "-st", "lpm+"):
        changed |= 3 << instruction.r
    return changed


@dataclass(frozen=True)
class Function:
    """One that a C compiler has made."""

    begin: int
    """Byte address."""
    end: int
    returns: bool
    """A value."""

    @property
    def result(self) -> int:
        """Registers that are read behind its end."""
        return _KEPT | (_RESULTS if self.returns else 0)


def live_registers(
    instructions: Mapping[int, Instruction],
    skipped_to: Callable[[Instruction], int],
    functions: Iterable[Function],
) -> dict[int, int]:
    """By address, registers that may be read after that instruction, as bits by number; of a call
    those that the called function or what is behind it may read. Time O(instructions)."""
    begins = {function.begin for function in functions}
    owner = {at: function for function in functions for at in range(function.begin, function.end)}

    def ahead(instruction: Instruction) -> Sequence[int] | None:
        if instruction.name in ("reti", "ijmp", "icall", "invalid"):
            return None
        if instruction.name in ("call", "rcall"):
            return (instruction.end, instruction.target)
        return followers(instruction, skipped_to)

    def joined(instruction: Instruction, read: Sequence[int]) -> int:
        at, name = instruction.address, instruction.name
        if name in ("call", "rcall"):
            kept = _KEPT if instruction.target in begins else ALL_REGISTERS
            return read[0] & kept | read[1]
        live = 0
        for part in read:
            live |= part
        own = owner.get(at)
        leaves = name == "ret" or any(
            owner.get(to) is not own for to in followers(instruction, skipped_to)
        )
        return live | own.result if own is not None and leaves else live

    def needed(instruction: Instruction, after: int) -> int:
        return (after & ~registers_changed(instruction)) | registers_read(instruction)

    return live_after(instructions, ahead, needed, joined, ALL_REGISTERS)
