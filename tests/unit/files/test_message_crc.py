"""The checksum of messages equals that of the firmware and of the fact sheet."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kilotwin.files.message_crc import message_crc


@pytest.mark.parametrize(
    ("data", "crc"),
    [
        (b"123456789", 0x6F91),
        (bytes(9) + b"\x00", 0x9C87),
        (bytes(9) + b"\x01", 0x8D0E),
        (bytes(range(1, 10)) + b"\x02", 0x840A),
        (bytes(9) + b"\x88", 0x94C7),
        (b"\xff" * 9 + b"\x7f", 0x036D),
        (b"", 0xFFFF),
    ],
)
def test_it_gives_the_values_measured_on_a_robot(data: bytes, crc: int) -> None:
    """hardware.md 1.5."""
    assert message_crc(data) == crc


@given(st.binary(max_size=300))
def test_it_is_the_polynomial_bit_by_bit(data: bytes) -> None:
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0x8408 if crc & 1 else crc >> 1
    assert message_crc(data) == crc
