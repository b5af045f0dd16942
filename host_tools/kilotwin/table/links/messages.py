"""Infrared messages to robots' boot loaders: nine data bytes and a type (boot_loaders.md 5.1)."""

from collections.abc import Sequence

from kilotwin.experiment.spec.overhead import message
from kilotwin.files.flash_image import FlashImage
from kilotwin.files.message_crc import message_crc
from kilotwin.table.links.robot_link import MessageType

CRCS_PER_MESSAGE = 4

BOOT = message((), MessageType.BOOT)
"""Calls an application's robot into its boot loader."""
START = message((), MessageType.START)
"""Starts the application if it is valid."""


def size(image: FlashImage) -> bytes:
    """Announces an image with its CRC and id, which original loaders overlook."""
    check = image.crc16.to_bytes(2, "little") + image.image_id.to_bytes(4, "little")
    return message([len(image.pages), *b"KT", *check], MessageType.SIZE)


def page_crcs(pages: Sequence[bytes], first: int) -> bytes:
    """The CRCs of `first`, a multiple of 4, and the three pages behind it; 0 where is none."""
    crcs = [message_crc(page) for page in pages[first : first + CRCS_PER_MESSAGE]]
    crcs += [0] * (CRCS_PER_MESSAGE - len(crcs))
    return message([first, *b"".join(crc.to_bytes(2, "little") for crc in crcs)], MessageType.CRC)
