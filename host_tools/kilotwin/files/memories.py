"""A chip's memories in one Intel HEX file, at any addresses; read and written by intelhex.

Programs are read by files/flash_image.py, which knows what an image is.
"""

import io
from pathlib import Path

from intelhex import HexReaderError, IntelHex

from kilotwin.errors import InputError, cause_of
from kilotwin.files.drafts import draft_of
from kilotwin.files.flash_map import Segments

_END = ":00000001FF"


def read_memories(path: Path) -> Segments:
    """The bytes of a file by address, neighbours joined; InputError if it is damaged or cut off."""
    try:
        text = path.read_text(encoding="ascii", errors="replace")
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"{path}: {reason}; name a .hex file") from None
    content = IntelHex()
    try:
        content.loadhex(io.StringIO(text))
    except HexReaderError as error:
        what = str(error)
        raise InputError(f"{path}: {what[0].lower()}{what[1:]}; name a whole .hex file") from None
    # The library takes a file without an end for a whole one.
    if not text.upper().split()[-1:] == [_END]:
        raise InputError(f"{path}: its end record is missing; name a whole .hex file")
    return {begin: content.tobinstr(begin, end - 1) for begin, end in content.segments()}


def write_memories(path: Path, segments: Segments) -> None:
    """Writes the file whole, or leaves the one that is there."""
    content = IntelHex()
    for address, data in segments.items():
        content.puts(address, data)
    with draft_of(path) as draft, draft.open("w", encoding="ascii") as file:
        content.write_hex_file(file)
