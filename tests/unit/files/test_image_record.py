"""The image record and the reset vector, byte by byte as the boot loader's contract has them."""

import struct
import zlib

import pytest

from kilotwin.errors import InputError
from kilotwin.files.image_record import is_recorded, recorded
from kilotwin.files.message_crc import message_crc

JMP_60 = b"\x0c\x94\x30\x00"  # jmp 0x0060
PROGRAM = JMP_60 + b"\x01\x02\x03" * 50


def test_the_reset_vector_leads_to_the_loader_and_the_record_keeps_the_programs_own() -> None:
    image = recorded({0: PROGRAM})
    page_bytes = PROGRAM.ljust(256, b"\xff")
    assert image[0] == b"\x0c\x94\x02\x38" + page_bytes[4:]  # jmp 0x7004
    record = image[0x6F80]
    assert len(record) == 16
    slide, pages, known, crc, image_id = struct.unpack_from("<HBBHI", record)
    assert slide == 0xC03F  # rjmp 0x7000
    assert (pages, known) == (2, 1)
    assert crc == message_crc(page_bytes)
    assert image_id == zlib.crc32(page_bytes)
    assert record[10:14] == JMP_60
    assert record[14:] == message_crc(record[:14]).to_bytes(2, "little")
    assert set(image) == {0, 0x6F80}


def test_a_relative_jump_is_a_first_instruction_too() -> None:
    image = recorded({0: b"\x2f\xc0" + bytes(200)})  # rjmp 0x0060
    assert image[0] == b"\x0c\x94\x02\x38" + bytes(198) + b"\xff" * 54
    assert image[0x6F80][10:14] == b"\x2f\xc0\x00\x00"


@pytest.mark.parametrize(
    "first",
    [
        b"\x00\x00\x00\x00",  # nop
        b"\x0c\x94\x00\x00",  # jmp 0
        b"\x0c\x94\x80\x00",  # jmp behind the image
        b"\xff\xcf\x00\x00",  # rjmp to itself: backwards
        b"\x00\xc0\x00\x00",  # rjmp into the vector
    ],
)
def test_a_program_that_no_loader_could_start_is_refused(first: bytes) -> None:
    with pytest.raises(InputError, match="does not begin with a jump into itself"):
        recorded({0: first + b"\x00" * 200})


def test_a_loader_of_ours_is_known_by_what_it_has_stored() -> None:
    erased = bytearray(b"\xff" * 0x8000)
    assert not is_recorded(bytes(erased))
    image = recorded({0: PROGRAM})
    with_vector, with_record = erased.copy(), erased.copy()
    with_vector[:256] = image[0]
    with_record[0x6F80:0x6F90] = image[0x6F80]
    assert is_recorded(bytes(with_vector))
    assert is_recorded(bytes(with_record))
    with_record[0x6F85] ^= 1
    assert not is_recorded(bytes(with_record))
