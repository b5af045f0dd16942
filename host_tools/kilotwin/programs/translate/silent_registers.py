"""Registers that a program names, and that are memory and no more where it runs translated."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from kilotwin.experiment.programs import Program
from kilotwin.programs.code_places import CodePlaces
from kilotwin.programs.translate.instructions import decode
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


def silent_registers(
    program: Program, flash: bytes, elf: Path, objects: Sequence[Path]
) -> Iterator[str]:
    """A line for each that the program's own code names, with the place where it does first."""
    places = CodePlaces(elf.read_bytes(), program)
    told: set[str] = set()
    for address, register in _named(flash, own_extents(elf, objects)):
        if register in told:
            continue
        told.add(register)
        place = places.of([address])
        where = program.written if place is None else place.text()
        yield (
            f"{where}: {register} is memory and no more where a program runs translated; "
            'cpu = "avr" has what it does'
        )


def _named(flash: bytes, extents: Sequence[tuple[int, int]]) -> Iterator[tuple[int, str]]:
    for begin, end in extents:
        at = begin
        while at < end:
            instruction = decode(flash, at)
            named = -1
            if instruction.name in _BY_ADDRESS:
                named = instruction.k
            elif instruction.name in _BY_BIT:
                named = instruction.r
            if named in _SILENT:
                yield at, _SILENT[named]
            at = instruction.end
