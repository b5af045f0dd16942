"""EEPROMs of robots kept in files, so that no flash can lose a calibration."""

import zlib
from pathlib import Path

from kilotwin.errors import InputError, cause_of
from kilotwin.files.memories import read_memories, write_memories
from kilotwin.table.flash.chip import EEPROM_BYTES
from kilotwin.table.flash.chip_file import EEPROM_BASE


def keep(folder: Path, eeprom: bytes, uid: int) -> Path:
    """Writes `uid-12-1a2b3c4d.hex`, named by what is in it: no file is ever overwritten by another.

    InputError if it cannot be written.
    """
    file = folder / f"uid-{uid}-{zlib.crc32(eeprom):08x}.hex"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not file.exists():
            write_memories(file, {0: eeprom})
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"--keep {folder}: {reason}; name another folder") from None
    return file


def read(path: Path, eeprom: bytes) -> bytes:
    """`eeprom` with the bytes of a file that was kept, or of one from avr-objcopy, laid over it."""
    laid = bytearray(eeprom)
    for address, data in read_memories(path).items():
        at = address - EEPROM_BASE if address >= EEPROM_BASE else address
        if at + len(data) > EEPROM_BYTES:
            raise InputError(
                f"--eeprom {path}: bytes at 0x{address:X} are not in the EEPROM of 1 KB; name an "
                "EEPROM's .hex"
            )
        laid[at : at + len(data)] = data
    return bytes(laid)
