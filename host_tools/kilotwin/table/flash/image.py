"""Content of a robot's flash: an application, a boot loader, by address."""

from pathlib import Path

from kilotwin.errors import InputError
from kilotwin.files import image_record
from kilotwin.files.build_id import Target
from kilotwin.files.flash_image import FlashImage, read_hex
from kilotwin.files.flash_map import FLASH_BYTES, LOADER_BEGIN, Segments
from kilotwin.files.headers import PAGE_BYTES, PAGES

_ERASED = b"\xff"


def application_of(path: Path) -> Segments:
    """A robot's application, from address 0 on, and the boot loader if the file brings one.

    InputError if it is no whole .hex file, is for a module, or the chip lacks room.
    """
    image = read_hex(path, range(FLASH_BYTES))
    _check_target(path, image, "robot")
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


def swarm_image(path: Path) -> FlashImage:
    """A robot's application, to be sent over the air.

    InputError if it is no whole .hex file, is for a module, is larger than 220 pages, or does not
    begin with a jump into itself: no boot loader could start it.
    """
    return _loadable(path, "robot")


def modules_image(path: Path) -> FlashImage:
    """The same of an application for a Kilogrid's modules."""
    return _loadable(path, "module")


def _loadable(path: Path, target: Target) -> FlashImage:
    image = read_hex(path)
    _check_target(path, image, target)
    if not image_record.can_be_started(image):
        raise InputError(
            f"{path}: does not begin with a jump into itself, so no boot loader can start it; "
            "name a .hex that avr-gcc made"
        )
    return image


def _check_target(path: Path, image: FlashImage, target: Target) -> None:
    if image.build_id is not None and image.build_id.target != target:
        what = f"{path} was built for a {image.build_id.target}"
        raise InputError(f"{what}; name a {target}'s program")


def loader_of(path: Path) -> Segments:
    """A boot loader; InputError if it is not all in the boot section."""
    return {LOADER_BEGIN: read_hex(path, range(LOADER_BEGIN, FLASH_BYTES)).content}


def pages_of(segments: Segments) -> int:
    """Pages of flash that the application takes, from address 0 on."""
    return -(-len(segments[0]) // PAGE_BYTES)


def has_loader(segments: Segments) -> bool:
    """Whether there is anything in the boot section."""
    return LOADER_BEGIN in segments
