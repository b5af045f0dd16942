"""Content of a robot's flash: an application, a boot loader, by address."""

from pathlib import Path

from kilotwin.errors import InputError
from kilotwin.files.flash_image import read_hex
from kilotwin.files.headers import PAGE_BYTES, PAGES

LOADER_BEGIN = 0x7000
"""Byte address of the boot section; what is below is the application's (hardware.md 1.11)."""

FLASH_BYTES = 0x8000

Segments = dict[int, bytes]
"""Bytes by the address of the first; those in between are erased."""

_ERASED = b"\xff"


def application_of(path: Path) -> Segments:
    """A robot's application, from address 0 on, and the boot loader if the file brings one.

    InputError if it is no whole .hex file, is for a module, or the chip lacks room.
    """
    image = read_hex(path, range(FLASH_BYTES))
    if image.build_id is not None and image.build_id.target != "robot":
        raise InputError(f"{path} was built for a {image.build_id.target}; name a robot's program")
    application, loader = image.content[:LOADER_BEGIN], image.content[LOADER_BEGIN:]
    if loader:
        application = application.rstrip(_ERASED)
    if not application:
        raise InputError(f"{path} holds a boot loader alone; name a program, and this by --loader")
    segments = {0: application} | ({LOADER_BEGIN: loader} if loader else {})
    if pages_of(segments) > PAGES:
        raise InputError(
            f"{path}: {pages_of(segments)} pages of {PAGE_BYTES} bytes; a robot's program has "
            f"{PAGES} at most, make it smaller"
        )
    return segments


def loader_of(path: Path) -> Segments:
    """A boot loader; InputError if it is not all in the boot section."""
    return {LOADER_BEGIN: read_hex(path, range(LOADER_BEGIN, FLASH_BYTES)).content}


def pages_of(segments: Segments) -> int:
    """Pages of flash that the application takes, from address 0 on."""
    return -(-len(segments[0]) // PAGE_BYTES)


def has_loader(segments: Segments) -> bool:
    """Whether there is anything in the boot section."""
    return LOADER_BEGIN in segments
