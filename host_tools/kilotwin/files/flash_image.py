"""Images for flashing, read from Intel HEX and checked record by record.

What comes out is what every way to flash takes: pages from address 0, gaps erased. A file that is
damaged, cut off, or not for the application's flash is refused as a whole, with the line.
"""

import zlib
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path

from kilotwin.errors import InputError, cause_of
from kilotwin.files.build_id import BuildId, find_build_id
from kilotwin.files.headers import PAGE_BYTES, PAGES
from kilotwin.files.message_crc import message_crc

APPLICATION = range(PAGES * PAGE_BYTES)
"""Addresses of a program's flash: 220 pages; the boot section is above (hardware.md 1.11)."""

_ERASED = b"\xff"
_AGAIN = "build it again, or get another copy"
_DAMAGED = f"the file is cut off or damaged: {_AGAIN}"
_FRAME_BYTES = 5  # of a record: all but its data


class _Kind(IntEnum):
    """Types of records."""

    DATA = 0
    END = 1
    SEGMENT_ADDRESS = 2
    SEGMENT_START = 3
    LINEAR_ADDRESS = 4
    LINEAR_START = 5


# By how many bits the two bytes of an address record are shifted.
_SHIFTS = {_Kind.SEGMENT_ADDRESS: 4, _Kind.LINEAR_ADDRESS: 16}


@dataclass(frozen=True)
class FlashImage:
    """The bytes to flash, from the first address of the memory they are for."""

    content: bytes
    """Up to the last byte given, at least one; bytes in between that are not given are 0xFF."""

    @property
    def padded(self) -> bytes:
        """`content` as whole pages, filled up with 0xFF."""
        return self.content + _ERASED * (-len(self.content) % PAGE_BYTES)

    @property
    def pages(self) -> list[bytes]:
        """The same page by page, 128 bytes each."""
        padded = self.padded
        return [padded[at : at + PAGE_BYTES] for at in range(0, len(padded), PAGE_BYTES)]

    @property
    def crc16(self) -> int:
        """kilolib's message CRC over `padded`: what a boot loader computes."""
        return message_crc(self.padded)

    @property
    def image_id(self) -> int:
        """CRC-32 (zlib's) of `padded`: two images with one id have the same bytes."""
        return zlib.crc32(self.padded)

    @property
    def build_id(self) -> BuildId | None:
        """The build id in it; None in images of others."""
        return find_build_id(self.content)


def read_hex(file: Path, memory: range = APPLICATION) -> FlashImage:
    """The image in a .hex file whose bytes all lie in `memory`, a range of byte addresses.

    InputError with file and line: no such file, no Intel HEX, a wrong checksum, a file without its
    end or with two, bytes given twice or outside of `memory`, none at all.
    """
    try:
        text = file.read_text(encoding="ascii", errors="replace")
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"{file}: {reason}; name a .hex file") from None
    reader = _Reader(str(file), memory)
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip():
            reader.take(line.strip(), number)
    return reader.image()


@dataclass
class _Reader:
    """One pass over the lines of a file."""

    name: str
    memory: range
    base: int = 0
    ended: bool = False
    line: int = 0
    content: bytearray = field(default_factory=bytearray)
    lines: dict[int, int] = field(default_factory=dict)
    """By address, the line that gave the byte."""

    def error(self, what: str) -> InputError:
        return InputError(f"{self.name}:{self.line}: {what}")

    def take(self, line: str, number: int) -> None:
        """The next line with something in it."""
        self.line = number
        if self.ended:
            raise self.error(f"there is more after the end record; {_AGAIN}")
        record = self._bytes_of(line)
        data, kind = record[4:-1], record[3]
        if kind == _Kind.DATA:
            self._store(self.base + int.from_bytes(record[1:3], "big"), data)
        elif kind == _Kind.END:
            self.ended = True
        elif kind in _SHIFTS:
            if len(data) != 2:
                raise self.error(f"an address record has two bytes, not {len(data)}; {_AGAIN}")
            self.base = int.from_bytes(data, "big") << _SHIFTS[_Kind(kind)]
        elif kind not in tuple(_Kind):  # an AVR starts at its reset vector, wherever they say
            raise self.error(f"record type 0x{kind:02X}; Intel HEX has 00 to 05: {_AGAIN}")

    def _bytes_of(self, line: str) -> bytes:
        if not line.startswith(":"):
            raise self.error("a line of Intel HEX begins with a colon; name a .hex file")
        try:
            record = bytes.fromhex(line[1:])
        except ValueError:
            what = f"after the colon there are pairs of hexadecimal digits; {_DAMAGED}"
            raise self.error(what) from None
        if len(record) < _FRAME_BYTES or len(record) != _FRAME_BYTES + record[0]:
            raise self.error(f"the record is not as long as it says; {_DAMAGED}")
        if sum(record) % 256 != 0:
            raise self.error(f"wrong checksum; {_DAMAGED}")
        return record

    def _store(self, address: int, data: bytes) -> None:
        for at, byte in enumerate(data, address):
            if at not in self.memory:
                raise self.error(self._outside(at))
            if at in self.lines:
                what = f"the byte at 0x{at:04X} was given before, in line {self.lines[at]}"
                raise self.error(f"{what}; are these two images? {_AGAIN}")
            self.lines[at] = self.line
            place = at - self.memory.start
            self.content.extend(_ERASED * (place + 1 - len(self.content)))
            self.content[place] = byte

    def _outside(self, address: int) -> str:
        first, last = self.memory.start, self.memory.stop - 1
        pages = len(self.memory) // PAGE_BYTES
        return (
            f"a byte at 0x{address:04X}; it goes from 0x{first:04X} to 0x{last:04X}, {pages} pages "
            f"of {PAGE_BYTES} bytes: make the program smaller, or name the .hex of a program alone"
        )

    def image(self) -> FlashImage:
        """The image, at the end of the file."""
        if self.line and not self.ended:
            what = "half a hex file, its end record is missing"
            raise self.error(f"{what}; {_AGAIN}")
        if not self.content:
            raise InputError(f"{self.name}: has no bytes to flash; {_AGAIN}")
        return FlashImage(bytes(self.content))
