"""Finds what a program's own code needs of a real ATmega328P: interrupt handlers of its own,
`sleep`, and registers that are plain memory where it runs translated."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from kilotwin.experiment.programs import Program
from kilotwin.programs.code_places import CodePlaces
from kilotwin.programs.translate.instructions import Instruction, decode
from kilotwin.programs.translate.seam import own_extents

_SILENT = {
    **{0x23: "PINB", 0x26: "PINC"},
    **{0x78: "ADC", 0x79: "ADC", 0x7A: "ADCSRA", 0x7B: "ADCSRB", 0x7C: "ADMUX", 0x50: "ACSR"},
    **{0x36: "TIFR1", 0x37: "TIFR2", 0x6F: "TIMSK1", 0x70: "TIMSK2", 0xB2: "TCNT2"},
    **{0x80: "TCCR1A", 0x81: "TCCR1B", 0x86: "ICR1", 0x88: "OCR1A", 0x8A: "OCR1B", 0xB6: "ASSR"},
    **{0x3C: "EIFR", 0x3D: "EIMSK", 0x69: "EICRA", 0x68: "PCICR"},
    **{0x6B: "PCMSK0", 0x6C: "PCMSK1", 0x6D: "PCMSK2", 0x3B: "PCIFR"},
    **{0x4C: "SPCR", 0x4D: "SPSR", 0x4E: "SPDR", 0x57: "SPMCSR"},
    **{0xB8: "TWBR", 0xB9: "TWSR", 0xBA: "TWAR", 0xBB: "TWDR", 0xBC: "TWCR"},
    **{0x53: "SMCR", 0x60: "WDTCSR", 0x61: "CLKPR"},
}
"""By address in data space; those of two bytes by the lower one."""
_BY_ADDRESS = {"in", "out", "lds", "sts"}
_BY_BIT = {"sbi", "cbi", "sbic", "sbis"}  # the address is where others have a register
_BY_POINTER = {"ld", "st", "ldd", "std"}
_VECTOR_BYTES = 4
# fmt: off
_VECTORS = (
    "RESET", "INT0", "INT1", "PCINT0", "PCINT1", "PCINT2", "WDT", "TIMER2_COMPA", "TIMER2_COMPB",
    "TIMER2_OVF", "TIMER1_CAPT", "TIMER1_COMPA", "TIMER1_COMPB", "TIMER1_OVF", "TIMER0_COMPA",
    "TIMER0_COMPB", "TIMER0_OVF", "SPI_STC", "USART_RX", "USART_UDRE", "USART_TX", "ADC",
    "EE_READY", "ANALOG_COMP", "TWI", "SPM_READY",
)
# fmt: on


def needs_chip(program: Program, flash: bytes, elf: Path, objects: Sequence[Path]) -> Iterator[str]:
    """A line for each such thing, with the place where the program's own code first has it: from
    the vectors of the image, and from its instructions."""
    extents = own_extents(elf, objects)
    places = CodePlaces(elf.read_bytes(), program)
    told: set[str] = set()
    for address, what in [*_handlers(flash, extents), *_named(flash, extents)]:
        if what in told:
            continue
        told.add(what)
        place = places.of([address])
        yield f"{program.written if place is None else place.text()}: {what}"


def _handlers(flash: bytes, extents: Sequence[tuple[int, int]]) -> Iterator[tuple[int, str]]:
    """Those of the program's own that vectors lead to. The first vector is the reset's."""
    for number, name in list(enumerate(_VECTORS))[1:]:
        vector = decode(flash, _VECTOR_BYTES * number)
        is_own = any(begin <= vector.target < end for begin, end in extents)
        if vector.name in ("jmp", "rjmp") and is_own:
            yield vector.target, f"ISR({name}_vect)"


def _named(flash: bytes, extents: Sequence[tuple[int, int]]) -> Iterator[tuple[int, str]]:
    for begin, end in extents:
        at = begin
        loaded: dict[int, int] = {}  # constants in registers, in code that runs straight on
        while at < end:
            instruction = decode(flash, at)
            register = _register(instruction, loaded)
            if register in _SILENT:
                yield at, _SILENT[register]
            if instruction.name == "sleep":
                yield at, "sleep"
            if instruction.name == "ldi":
                loaded[instruction.d] = instruction.k
            elif instruction.target:
                loaded = {}
            else:
                for changed in (instruction.d, instruction.d + 1):
                    loaded.pop(changed, None)
            at = instruction.end


def _register(instruction: Instruction, loaded: Mapping[int, int]) -> int:
    """The data address of what an instruction reads or writes, as far as it is known; -1."""
    name = instruction.name
    if name in _BY_ADDRESS:
        return instruction.k
    if name in _BY_BIT:
        return instruction.r
    low, high = loaded.get(instruction.r), loaded.get(instruction.r + 1)
    if name not in _BY_POINTER or low is None or high is None:
        return -1
    return (high << 8 | low) + instruction.k
