"""Intel HEX files: what is in them, checked as far as a robot's chip makes it possible."""

import io
from pathlib import Path

from intelhex import AddressOverlapError, HexReaderError, IntelHex, RecordChecksumError

from kilotwin.errors import InputError
from kilotwin.files.drafts import draft_of

PAGE_BYTES = 128
"""Of the ATmega328P's flash."""

LOADER_BEGIN = 0x7000
"""Byte address of the boot section; what is below is the application's (hardware.md 1.11)."""

FLASH_BYTES = 0x8000
MOST_PAGES = 220
"""Of an application: what a boot loader takes (hardware.md 1.11)."""

_END = ":00000001FF"

Segments = dict[int, bytes]
"""Bytes by the address of the first; those in between are erased."""


def read_hex(path: Path) -> Segments:
    """The bytes of a file by address, in order, neighbours joined.

    InputError with the line if it is cut off, damaged, empty or no Intel HEX.
    """
    try:
        text = path.read_text(encoding="ascii")
    except UnicodeDecodeError:
        raise InputError(f"{path} is no Intel HEX file; name a .hex") from None
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"{path}: {reason}; name a .hex file") from None
    content = IntelHex()
    try:
        content.loadhex(io.StringIO(text))
    except RecordChecksumError as error:
        raise InputError(
            f"{path}:{error.line}: wrong checksum; the file is damaged, make it anew"
        ) from None
    except AddressOverlapError as error:
        raise InputError(
            f"{path}:{error.line}: the byte at 0x{error.address:04X} was given before; two files "
            "in one are no program"
        ) from None
    except HexReaderError as error:
        line = getattr(error, "line", len(text.splitlines()))
        raise InputError(
            f"{path}:{line}: this is no record of Intel HEX; is the file cut off? Make it anew"
        ) from None
    _check_end(path, text)
    if not content.segments():
        raise InputError(f"{path} holds no byte; name the .hex of a program")
    return {begin: content.tobinstr(begin, end - 1) for begin, end in content.segments()}


def _check_end(path: Path, text: str) -> None:
    """The library takes a file without an end for a whole one, and ignores what follows an end."""
    lines = text.split()
    ends = [number for number, line in enumerate(lines) if line.upper() == _END]
    if not ends:
        raise InputError(f"{path}: its end record is missing, so it is cut off; make it anew")
    if ends[0] != len(lines) - 1:
        raise InputError(f"{path}: there is more after its end; two files in one are no program")


def write_hex(path: Path, segments: Segments) -> None:
    """Writes the file whole, or leaves the one that is there."""
    content = IntelHex()
    for address, data in segments.items():
        content.puts(address, data)
    with draft_of(path) as draft, draft.open("w", encoding="ascii") as file:
        content.write_hex_file(file, eolstyle="native")


def application_of(path: Path) -> Segments:
    """A robot's application, which may bring a boot loader; InputError if the chip lacks room."""
    segments = read_hex(path)
    for begin, data in segments.items():
        end = begin + len(data)
        if end > FLASH_BYTES:
            raise InputError(
                f"{path}: bytes at 0x{max(begin, FLASH_BYTES):X} are not in the ATmega328P's flash "
                "of 32 KB; name a robot's .hex, without EEPROM and fuses"
            )
        if begin < LOADER_BEGIN and end > MOST_PAGES * PAGE_BYTES:
            pages = -(-min(end, LOADER_BEGIN) // PAGE_BYTES)
            raise InputError(
                f"{path}: {pages} pages of 128 bytes; a robot's program has {MOST_PAGES} at most, "
                "make it smaller"
            )
    if min(segments) >= LOADER_BEGIN:
        raise InputError(f"{path} holds a boot loader alone; name a program, and this by --loader")
    return segments


def pages_of(segments: Segments) -> int:
    """Pages of flash that the application takes, from address 0 on."""
    end = max(begin + len(data) for begin, data in segments.items() if begin < LOADER_BEGIN)
    return -(-min(end, LOADER_BEGIN) // PAGE_BYTES)


def has_loader(segments: Segments) -> bool:
    """Whether there is anything in the boot section."""
    return any(begin + len(data) > LOADER_BEGIN for begin, data in segments.items())
