"""Sizes of an image on the chip: the one number for flash, and the one for RAM."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from elftools.elf.elffile import ELFFile

from kilotwin.files.flash_image import APPLICATION
from kilotwin.programs.image.flags import avr_words

FLASH_BYTES = len(APPLICATION)
"""Below the boot section: 28,160, of which a page is 128."""

RAM_BYTES = 2048

# Addresses of an ELF file from here on are not in flash (avr-gcc's address spaces in one).
_RAM_BASE = 0x800000
_VARIABLES = (".data", ".bss", ".noinit")


@dataclass(frozen=True)
class ImageSize:
    """Bytes."""

    flash: int
    """All that the .hex holds: code, the values that variables begin with, and the build id."""
    ram: int
    """Variables; what is left of RAM_BYTES is for stack and malloc()."""
    left_out: dict[str, int]
    """Sections with something in them that a .hex for the flash comes without, as .eeprom."""


def size_of(elf: Path) -> ImageSize:
    """The size of a linked program."""
    with elf.open("rb") as stream:
        file = ELFFile(stream)
        sections = {section.name: section["sh_size"] for section in file.iter_sections()}
        return ImageSize(
            max(_flash_ends(file), default=0),
            sum(sections.get(name, 0) for name in _VARIABLES),
            {name: sections[name] for name in avr_words("AVR_NOT_FLASHED") if sections.get(name)},
        )


def _flash_ends(file: ELFFile) -> Iterator[int]:
    for segment in file.iter_segments("PT_LOAD"):
        if segment["p_paddr"] < _RAM_BASE:
            yield segment["p_paddr"] + segment["p_filesz"]
