"""The host's sending side of what takes more than one CAN frame.

Each function gives the frames of one transfer in order, with the pause a module needs after each;
kilogrid_modules/protocol/transfer.h is the receiving side. A chunk that is lost spoils its
transfer, which then has to be sent again from its beginning; nothing acknowledges it.
"""

from collections.abc import Iterator
from typing import NamedTuple

from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import PAGE_BYTES, PAGES
from kilotwin.files.message_crc import message_crc
from kilotwin.table.can.protocol import FrameError, to_module

CONFIG_BYTES = 48
CHUNK_BYTES = 6
IR_BYTES = 9
CRCS_PER_FRAME = 3

# Gaps of the original dispatcher (hardware.md 3.7); a module handles a frame in less.
_CHUNK_PAUSE_S = 0.001
_CONFIG_PAUSE_S = 0.005
# Longer than a frame by infrared: a module that sends one does not read its two buffers meanwhile.
_IR_PAUSE_S = 0.005
_NUMBER_PAUSE_S = 0.010
_PAGE_PAUSE_S = 0.100
# A loader reads three pages for the CRCs, and erases those that differ; an answer takes a look at
# 32 pages.
_CRC_PAUSE_S = 0.006
_QUERY_PAUSE_S = 0.002

_OLD = {False: "", True: "OLD_"}


class Paced(NamedTuple):
    """A frame's data bytes, and how long to wait before the next one to the same modules."""

    data: bytes
    pause_s: float


def _chunks(name: str, data: bytes, pause_s: float) -> Iterator[Paced]:
    for number, begin in enumerate(range(0, len(data), CHUNK_BYTES)):
        chunk = data[begin : begin + CHUNK_BYTES].ljust(CHUNK_BYTES, b"\0")
        signals = {f"Byte{i}": byte for i, byte in enumerate(chunk)}
        yield Paced(to_module(name, Sequence=number, **signals), pause_s)


def configuration(data: bytes) -> list[Paced]:
    """A module's configuration, 1 to 48 bytes; when the last frame is in, it runs setup()."""
    if not 0 < len(data) <= CONFIG_BYTES:
        raise FrameError(f"a configuration has 1 to {CONFIG_BYTES} bytes, not {len(data)}")
    size = Paced(to_module("MODULE_CONFIG_SIZE", ConfigSize=len(data)), _CONFIG_PAUSE_S)
    return [size, *_chunks("MODULE_CONFIG_TRANSFER", data, _CONFIG_PAUSE_S)]


def infrared(data: bytes, kind: int) -> list[Paced]:
    """An infrared message of nine data bytes and a type, which modules repeat on all cells."""
    if len(data) != IR_BYTES:
        raise FrameError(f"an infrared message has {IR_BYTES} data bytes, not {len(data)}")
    signals = {f"IrData{i}": byte for i, byte in enumerate(data)}
    first = {name: signals.pop(name) for name in list(signals)[:CHUNK_BYTES]}
    return [
        Paced(to_module("FORWARD_IR_MESSAGE", IrPart=0, **first), _IR_PAUSE_S),
        Paced(to_module("FORWARD_IR_MESSAGE", IrPart=1, IrType=kind, **signals), _IR_PAUSE_S),
    ]


def pages_of(program: bytes | FlashImage) -> list[bytes]:
    """A program's image as whole pages of flash; the rest of the last one stays erased."""
    image = program if isinstance(program, FlashImage) else FlashImage(program)
    size = len(image.content)
    if not 0 < size <= PAGES * PAGE_BYTES:
        raise FrameError(f"a program has 1 to {PAGES * PAGE_BYTES} bytes, not {size}")
    return image.pages


def _announcement(name: str, program: bytes | FlashImage, pause_s: float) -> Iterator[Paced]:
    """The frames of one of the three SIZE types that announce a program.

    Of a `FlashImage` also its CRC and id, first: modules and robots of ours check what they got by
    them. An original takes that frame for a number of pages, and the next one puts it right.
    """
    if isinstance(program, FlashImage):
        check = {"ImageCrc": program.crc16, "ImageId": program.image_id}
        yield Paced(to_module(name, SizePart=1, **check), pause_s)
    yield Paced(to_module(name, SizePart=0, Pages=len(pages_of(program))), pause_s)


def robots_announcement(program: bytes | FlashImage) -> Iterator[Paced]:
    """Announces a program for the robots; begins or closes a lap (docs/wire.md)."""
    return _announcement("KILO_BOOTPAGE_SIZE", program, _NUMBER_PAUSE_S)


def robots_page(number: int, page: bytes) -> Iterator[Paced]:
    """A page of the robots' program, which each module sends on by the cell whose lap it is."""
    yield Paced(to_module("KILO_BOOTPAGE_NUMBER", Page=number), _NUMBER_PAUSE_S)
    *chunks, last = _chunks("KILO_BOOTPAGE", page, _CHUNK_PAUSE_S)
    yield from chunks
    # The module sends the page to its robots before it can take the next.
    yield Paced(last.data, _PAGE_PAUSE_S)


def kilobot_program(program: bytes | FlashImage) -> Iterator[Paced]:
    """One lap of a program for the robots; four laps serve a module's four cells.

    Robots that missed a page pick it up in a later lap, so laps go on until the user stops them.
    """
    yield from robots_announcement(program)
    for number, page in enumerate(pages_of(program)):
        yield from robots_page(number, page)


def modules_announcement(
    program: bytes | FlashImage, *, old_loader: bool = False
) -> Iterator[Paced]:
    """Announces a program for the modules themselves, which are in their boot loaders."""
    return _announcement(f"{_OLD[old_loader]}MODULE_BOOTPAGE_SIZE", program, _CHUNK_PAUSE_S)


def modules_page(number: int, page: bytes, *, old_loader: bool = False) -> Iterator[Paced]:
    """A page of the modules' program: its number, then its 22 chunks."""
    name = f"{_OLD[old_loader]}MODULE_BOOTPAGE"
    yield Paced(to_module(f"{name}_NUMBER", Page=number), _CHUNK_PAUSE_S)
    # The loader takes three bytes from the last chunk: the third lies beyond the page.
    yield from _chunks(name, page, _CHUNK_PAUSE_S)


def modules_page_crcs(image: FlashImage, first: int) -> Paced:
    """The CRCs of pages `first`, a multiple of CRCS_PER_FRAME, and the next two (0 if none)."""
    pages = image.pages[first : first + CRCS_PER_FRAME]
    crcs = {f"PageCrc{i}": message_crc(page) for i, page in enumerate(pages)}
    unused = {f"PageCrc{i}": 0 for i in range(len(pages), CRCS_PER_FRAME)}
    return Paced(to_module("MODULE_BOOTPAGE_CRC", First=first, **crcs, **unused), _CRC_PAUSE_S)


def modules_boot_query(first: int) -> Paced:
    """Asks a module's loader which of 32 pages it lacks, from `first` on, or BOOT_IDENTITY."""
    return Paced(to_module("MODULE_BOOT_QUERY", First=first), _QUERY_PAUSE_S)


def module_program(program: bytes | FlashImage, *, old_loader: bool = True) -> Iterator[Paced]:
    """One lap of a program for the modules themselves, which are in their boot loaders.

    The loaders in the field number these frames as the dispatcher does for them, 0x9F higher:
    `old_loader`. One that is to be found again after a lost frame is sent the whole lap again.
    """
    yield from modules_announcement(program, old_loader=old_loader)
    for number, page in enumerate(pages_of(program)):
        yield from modules_page(number, page, old_loader=old_loader)
