"""The instructions of an ATmega328P, decoded from machine code (AVR Instruction Set Manual)."""

from collections.abc import Callable
from dataclasses import dataclass

from kilotwin.files.flash_map import FLASH_BYTES

_LONG_MASK = 0xFE0F
_LONG = {0x9000, 0x9200, 0x940C, 0x940D, 0x940E, 0x940F}
_POINTERS = {"X": 26, "Y": 28, "Z": 30}


@dataclass(frozen=True)
class Instruction:
    """One of the machine code. What its operands are depends on its name."""

    address: int
    """Address of its first byte."""
    name: str
    """As the manual has it, in small letters; "invalid" for what the chip does not have."""
    d: int = 0
    """Register that it changes, or stores."""
    r: int = 0
    """Register that it only reads; of a pointer, the lower one."""
    k: int = 0
    """Constant, data address, displacement, or number of a bit."""
    target: int = 0
    """Byte address to which it jumps; beyond the flash where the chip wraps."""
    words: int = 1

    @property
    def end(self) -> int:
        """The byte address behind it."""
        return self.address + 2 * self.words


def is_long(word: int) -> bool:
    """Whether an instruction with this first word has two."""
    return word & _LONG_MASK in _LONG


def decode(flash: bytes, address: int) -> Instruction:
    """The instruction at a byte address; the flash is read with erased bytes behind its end."""
    word = _word(flash, address)
    for mask, pattern, make in _FORMATS:
        if word & mask == pattern:
            return make(address, word, _word(flash, address + 2))
    return Instruction(address, "invalid")


def _word(flash: bytes, address: int) -> int:
    pair = flash[address : address + 2]
    return int.from_bytes(pair.ljust(2, b"\xff"), "little")


_Make = Callable[[int, int, int], Instruction]


def _d(word: int) -> int:
    return word >> 4 & 31


def _r(word: int) -> int:
    return (word >> 5 & 16) | (word & 15)


def _k8(word: int) -> int:
    return (word >> 4 & 0xF0) | (word & 15)


def _two(name: str) -> _Make:
    return lambda at, word, _: Instruction(at, name, _d(word), _r(word))


def _one(name: str) -> _Make:
    return lambda at, word, _: Instruction(at, name, _d(word))


def _immediate(name: str) -> _Make:
    return lambda at, word, _: Instruction(at, name, 16 + (word >> 4 & 15), k=_k8(word))


def _alone(name: str) -> _Make:
    return lambda at, word, _: Instruction(at, name)


def _multiply(name: str, mask: int) -> _Make:
    return lambda at, word, _: Instruction(at, name, 16 + (word >> 4 & mask), 16 + (word & mask))


def _word_immediate(name: str) -> _Make:
    def make(at: int, word: int, _: int) -> Instruction:
        return Instruction(at, name, 24 + (word >> 3 & 6), k=(word >> 2 & 48) | (word & 15))

    return make


def _pointed(name: str, pointer: str) -> _Make:
    return lambda at, word, _: Instruction(at, name, _d(word), _POINTERS[pointer])


def _displaced(name: str, pointer: str) -> _Make:
    def make(at: int, word: int, _: int) -> Instruction:
        k = (word >> 8 & 32) | (word >> 7 & 24) | (word & 7)
        return Instruction(at, name, _d(word), _POINTERS[pointer], k)

    return make


def _direct(name: str) -> _Make:
    return lambda at, word, more: Instruction(at, name, _d(word), k=more, words=2)


def _long_jump(name: str) -> _Make:
    def make(at: int, word: int, more: int) -> Instruction:
        target = ((word >> 3 & 62) | (word & 1)) << 17 | more << 1
        return Instruction(at, name, target=target, words=2)

    return make


def _relative(name: str) -> _Make:
    def make(at: int, word: int, _: int) -> Instruction:
        offset = (word & 0xFFF) - (word << 1 & 0x1000)
        return Instruction(at, name, target=(at + 2 + 2 * offset) % FLASH_BYTES)

    return make


def _branch(name: str) -> _Make:
    def make(at: int, word: int, _: int) -> Instruction:
        offset = (word >> 3 & 63) - (word >> 3 & 64)
        target = (at + 2 + 2 * offset) & 0xFFFFFFFF
        return Instruction(at, name, k=word & 7, target=target)

    return make


def _low_bit(name: str) -> _Make:
    return lambda at, word, _: Instruction(at, name, r=32 + (word >> 3 & 31), k=word & 7)


def _register_bit(name: str) -> _Make:
    return lambda at, word, _: Instruction(at, name, _d(word), k=word & 7)


def _port(name: str) -> _Make:
    def make(at: int, word: int, _: int) -> Instruction:
        return Instruction(at, name, _d(word), k=32 + ((word >> 5 & 48) | (word & 15)))

    return make


def _flag(name: str) -> _Make:
    return lambda at, word, _: Instruction(at, name, k=word >> 4 & 7)


def _pair(at: int, word: int, _: int) -> Instruction:
    return Instruction(at, "movw", word >> 3 & 30, (word & 15) << 1)


# Mask, pattern, reader; of two that fit the first counts.
_FORMATS: list[tuple[int, int, _Make]] = [
    (0xFFFF, 0x0000, _alone("nop")),
    (0xFF00, 0x0100, _pair),
    (0xFF00, 0x0200, _multiply("muls", 15)),
    (0xFF88, 0x0300, _multiply("mulsu", 7)),
    (0xFF88, 0x0308, _multiply("fmul", 7)),
    (0xFF88, 0x0380, _multiply("fmuls", 7)),
    (0xFF88, 0x0388, _multiply("fmulsu", 7)),
    *(
        (0xFC00, pattern, _two(name))
        for pattern, name in [
            (0x0400, "cpc"),
            (0x0800, "sbc"),
            (0x0C00, "add"),
            (0x1000, "cpse"),
            (0x1400, "cp"),
            (0x1800, "sub"),
            (0x1C00, "adc"),
            (0x2000, "and"),
            (0x2400, "eor"),
            (0x2800, "or"),
            (0x2C00, "mov"),
            (0x9C00, "mul"),
        ]
    ),
    *(
        (0xF000, pattern, _immediate(name))
        for pattern, name in [
            (0x3000, "cpi"),
            (0x4000, "sbci"),
            (0x5000, "subi"),
            (0x6000, "ori"),
            (0x7000, "andi"),
            (0xE000, "ldi"),
        ]
    ),
    (0xD208, 0x8000, _displaced("ldd", "Z")),
    (0xD208, 0x8008, _displaced("ldd", "Y")),
    (0xD208, 0x8200, _displaced("std", "Z")),
    (0xD208, 0x8208, _displaced("std", "Y")),
    *(
        (0xFFFF, word, _alone(name))
        for word, name in [
            (0x9409, "ijmp"),
            (0x9509, "icall"),
            (0x9508, "ret"),
            (0x9518, "reti"),
            (0x9588, "sleep"),
            (0x9598, "break"),
            (0x95A8, "wdr"),
            (0x95C8, "lpm_r0"),
            (0x95E8, "spm"),
        ]
    ),
    (0xFF8F, 0x9408, _flag("bset")),
    (0xFF8F, 0x9488, _flag("bclr")),
    (0xFE0F, 0x9000, _direct("lds")),
    (0xFE0F, 0x9200, _direct("sts")),
    (0xFE0F, 0x9004, _pointed("lpm", "Z")),
    (0xFE0F, 0x9005, _pointed("lpm+", "Z")),
    *(
        (0xFE0F, pattern + offset, _pointed(name, pointer))
        for pattern, load in [(0x9000, "ld"), (0x9200, "st")]
        for offset, name, pointer in [
            (0x1, load + "+", "Z"),
            (0x2, "-" + load, "Z"),
            (0x9, load + "+", "Y"),
            (0xA, "-" + load, "Y"),
            (0xC, load, "X"),
            (0xD, load + "+", "X"),
            (0xE, "-" + load, "X"),
        ]
    ),
    (0xFE0F, 0x900F, _one("pop")),
    (0xFE0F, 0x920F, _one("push")),
    *(
        (0xFE0F, pattern, _one(name))
        for pattern, name in [
            (0x9400, "com"),
            (0x9401, "neg"),
            (0x9402, "swap"),
            (0x9403, "inc"),
            (0x9405, "asr"),
            (0x9406, "lsr"),
            (0x9407, "ror"),
            (0x940A, "dec"),
        ]
    ),
    (0xFE0E, 0x940C, _long_jump("jmp")),
    (0xFE0E, 0x940E, _long_jump("call")),
    (0xFF00, 0x9600, _word_immediate("adiw")),
    (0xFF00, 0x9700, _word_immediate("sbiw")),
    (0xFF00, 0x9800, _low_bit("cbi")),
    (0xFF00, 0x9900, _low_bit("sbic")),
    (0xFF00, 0x9A00, _low_bit("sbi")),
    (0xFF00, 0x9B00, _low_bit("sbis")),
    (0xF800, 0xB000, _port("in")),
    (0xF800, 0xB800, _port("out")),
    (0xF000, 0xC000, _relative("rjmp")),
    (0xF000, 0xD000, _relative("rcall")),
    (0xFC00, 0xF000, _branch("brbs")),
    (0xFC00, 0xF400, _branch("brbc")),
    (0xFE08, 0xF800, _register_bit("bld")),
    (0xFE08, 0xFA00, _register_bit("bst")),
    (0xFE08, 0xFC00, _register_bit("sbrc")),
    (0xFE08, 0xFE00, _register_bit("sbrs")),
]
