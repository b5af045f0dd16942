"""A simulated chip kept in a file, from session to session.

It is Intel HEX with avr-gcc's addresses: flash at 0, EEPROM, fuses, lock bits and signature each in
an address space of its own. `[[robots]] hex = "FILE"` runs the chip that it describes.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from kilotwin import _emulator
from kilotwin.errors import InputError, cause_of
from kilotwin.files.flash_map import Segments
from kilotwin.files.memories import read_memories, write_memories

if TYPE_CHECKING:
    from kilotwin._emulator import Programmer

# The signature's bytes stand in the file with the last one first, as avr-libc lays them.
EEPROM_BASE, FUSE_BASE, LOCK_BASE, SIGNATURE_BASE = 0x810000, 0x820000, 0x830000, 0x840000
_SPACE = 0x10000


def plug_in(path: Path | None) -> "Programmer":
    """A programmer in front of the chip in the file; a new one if there is none.

    What the file does not give is as in a new chip: erased, with a Kilobot's fuses. InputError if
    the file is no chip's.
    """
    programmer = _emulator.Programmer()
    if path is None or not path.exists():
        return programmer
    rest = read_memories(path)
    programmer.flash = _laid(path, rest, 0, programmer.flash)
    programmer.eeprom = _laid(path, rest, EEPROM_BASE, programmer.eeprom)
    programmer.fuses = _laid(path, rest, FUSE_BASE, programmer.fuses)
    programmer.lock_bits = _laid(path, rest, LOCK_BASE, bytes([programmer.lock_bits]))[0]
    reversed_ = _laid(path, rest, SIGNATURE_BASE, programmer.signature[::-1])
    programmer.signature = reversed_[::-1]
    if rest:
        raise InputError(
            f"{path}: bytes at 0x{min(rest):X} belong to no memory of an ATmega328P; name a chip's "
            "file, or one that is not there yet"
        )
    return programmer


def contents(programmer: "Programmer") -> Segments:
    """All that the chip keeps without power, by address; erased pages of flash are left out."""
    return {
        **_written(programmer.flash),
        EEPROM_BASE: programmer.eeprom,
        FUSE_BASE: programmer.fuses,
        LOCK_BASE: bytes([programmer.lock_bits]),
        SIGNATURE_BASE: programmer.signature[::-1],
    }


def save(path: Path, programmer: "Programmer") -> None:
    """Writes the file anew, whole; InputError if it cannot."""
    try:
        write_memories(path, contents(programmer))
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"--chip {path}: {reason}; name another file") from None


def _laid(path: Path, rest: Segments, base: int, memory: bytes) -> bytes:
    """`memory` with the file's bytes of its address space, which are taken out of `rest`."""
    laid = bytearray(memory)
    for address in [a for a in rest if base <= a < base + _SPACE]:
        data, at = rest.pop(address), address - base
        if at + len(data) > len(laid):
            raise InputError(
                f"{path}: bytes at 0x{address:X} and on do not fit into the chip's memory of "
                f"{len(laid)} bytes; name a chip's file, or one that is not there yet"
            )
        laid[at : at + len(data)] = data
    return bytes(laid)


def _written(flash: bytes, page_bytes: int = 128) -> Segments:
    pages = range(0, len(flash), page_bytes)
    erased = b"\xff" * page_bytes
    return {at: page for at in pages if (page := flash[at : at + page_bytes]) != erased}
