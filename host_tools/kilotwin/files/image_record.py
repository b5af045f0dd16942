"""The image record, by which a boot loader of ours knows that an application is whole.

The application's first instruction, a jump, goes into the record; in its place stands a jump into
the loader, so that power-up always comes by there. A program that a programmer has put there by
itself would start as well, but half of it would too when its first replacement is broken off.
"""

import struct

from kilotwin.errors import InputError
from kilotwin.files.flash_image import FlashImage
from kilotwin.files.flash_map import LOADER_BEGIN, Segments
from kilotwin.files.message_crc import message_crc

RECORD_BEGIN = 0x6F80
"""Byte address of the record's page, the last one below the boot section."""

_START = LOADER_BEGIN + 4  # the loader's entry that starts a valid application
_JMP, _RJMP, _RJMP_FORWARDS = 0x940C, 0xC000, 0xF800
_LOADERS_VECTOR = struct.pack("<HH", _JMP, _START // 2)
# A jump to the loader, for code that slides here through erased flash.
_SLIDE = _RJMP | (LOADER_BEGIN - RECORD_BEGIN) // 2 - 1
# Slide, pages, 1: CRC and id are known, CRC-16, CRC-32, the application's first instruction.
_RECORD = struct.Struct("<HBBHI4s")
_CRC = struct.Struct("<H")


def recorded(application: Segments) -> Segments:
    """The application with the loader's jump in front, and its record.

    InputError if it does not begin with a jump to a place in itself: no loader could start it.
    """
    image = FlashImage(application[0])
    padded = image.padded
    vector = padded[: len(_LOADERS_VECTOR)]
    if not can_be_started(image):
        raise InputError(
            "the program does not begin with a jump into itself, so no boot loader can start it; "
            "name a .hex that avr-gcc made, or type --loader none"
        )
    record = _RECORD.pack(_SLIDE, len(image.pages), 1, image.crc16, image.image_id, vector)
    return {
        0: _LOADERS_VECTOR + padded[len(vector) :],
        RECORD_BEGIN: record + _CRC.pack(message_crc(record)),
    }


def can_be_started(image: FlashImage) -> bool:
    """Whether it begins with a jump to a place in itself, as a boot loader wants it."""
    padded = image.padded
    return 2 <= _target(padded[: len(_LOADERS_VECTOR)]) < len(padded) // 2


def is_recorded(flash: bytes) -> bool:
    """Whether the loader in a chip is one of ours, by what it has stored."""
    record = flash[RECORD_BEGIN : RECORD_BEGIN + _RECORD.size + _CRC.size]
    return flash.startswith(_LOADERS_VECTOR) or (
        record.startswith(_CRC.pack(_SLIDE)) and message_crc(record) == 0
    )


def _target(vector: bytes) -> int:
    """The word address to which a jump leads; 0 if it is none. An rjmp counts from behind it."""
    first = int.from_bytes(vector[:2], "little")
    if first == _JMP:
        return int.from_bytes(vector[2:], "little")
    return (first & ~_RJMP_FORWARDS) + 1 if first & _RJMP_FORWARDS == _RJMP else 0
