"""Packets of the serial lines, whole and damaged."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kilotwin.table.links.packets import (
    CONTINUE,
    Dispatched,
    FromDispatcher,
    Notice,
    Overhead,
    Packet,
    Record,
    ToDevice,
    Tracking,
    encode,
    encode_notice,
    encode_page,
    encode_tracking,
)

RUN = encode(Overhead.FORWARDMSG, bytes(9) + b"\x88")
PAGE = bytes(range(128))


def test_a_packet_has_132_bytes_whose_xor_is_0() -> None:
    assert len(RUN) == 132
    assert RUN[:12] == bytes([0x55, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x88])
    assert RUN[131] == 0x55 ^ 2 ^ 0x88
    page = encode_page(Overhead.BOOTPAGE, 7, PAGE)
    assert page[:3] == bytes([0x55, 4, 7])
    assert page[3:131] == PAGE


def test_what_is_too_long_or_no_page_is_refused() -> None:
    with pytest.raises(ValueError, match="129 data bytes, not 130"):
        encode(Overhead.STOP, bytes(130))
    with pytest.raises(ValueError, match="128 bytes, not 127"):
        encode_page(Overhead.BOOTPAGE, 0, bytes(127))


def test_continue_has_three_bytes() -> None:
    assert bytes([0x55, 14, 0x5B]) == CONTINUE
    assert ToDevice().take(CONTINUE) == [Packet(14, b"")]


@given(
    packets=st.lists(
        st.tuples(st.sampled_from(range(14)), st.binary(min_size=129, max_size=129)), max_size=4
    ),
    cuts=st.lists(st.integers(1, 60), min_size=1),
)
def test_packets_are_found_however_their_bytes_come(
    packets: list[tuple[int, bytes]], cuts: list[int]
) -> None:
    line = b"".join(encode(kind, data) + CONTINUE for kind, data in packets)
    stream, found = ToDevice(), []
    while line:
        size = cuts[len(line) % len(cuts)]
        found += stream.take(line[:size])
        line = line[size:]
    assert found == [p for kind, data in packets for p in (Packet(kind, data), Packet(14, b""))]
    assert stream.junk == 0


def test_a_whole_packet_is_found_after_junk() -> None:
    stream = ToDevice()
    assert stream.take(b"\x55\x00hello\x55\x0e" + RUN + RUN) == [Packet(2, RUN[2:-1])] * 2
    assert stream.junk == 9


@pytest.mark.parametrize("damage", ["lost", "changed"])
def test_after_a_damaged_packet_the_next_ones_are_found_as_soon_as_they_are_complete(
    damage: str,
) -> None:
    chance = random.Random(1)
    for _ in range(50):
        place = chance.randrange(131)
        content = bytes(chance.choice([0x55, *chance.randbytes(7)]) for _ in range(128))
        bad = bytearray(encode_page(Overhead.BOOTPAGE, 3, content))
        if damage == "lost":
            del bad[place : place + 1 + chance.randrange(3)]
        else:
            bad[place] ^= 0x10
        stream = ToDevice()
        found = stream.take(bytes(bad)) + stream.take(RUN) + stream.take(RUN)
        assert found[-1] == Packet(2, RUN[2:-1]), (place, content.hex())
        # A lost 0x55 cannot be told: the next packet's header takes its place in the checksum.
        assert found.count(found[-1]) == 2 or bad[131:] == b""


RECORDS = (
    Record(3, 0, 1, b"\x01\x02\x03\x04\x05\x06\x07", 70_000),
    Record(9, 19, 3, b"\x55\x0f\xff\xa5\x00\x00\x00", 2**32 - 1),
)


def test_reports_have_a_checksum_of_their_own() -> None:
    packet = encode_tracking(Tracking(RECORDS))
    assert packet[:3] == bytes([0x55, 8, 2])
    assert packet[3:18] == bytes([3, 0, 3, 1, 1, 2, 3, 4, 5, 6, 7, 0x70, 0x11, 1, 0])
    assert len(packet) == 3 + 2 * 15 + 1
    assert FromDispatcher().take(packet) == [Tracking(RECORDS)]
    assert FromDispatcher().take(encode_tracking(Tracking(()))) == [Tracking(())]


def test_short_packets_and_reports_are_told_apart_in_one_stream() -> None:
    asked = Notice(Dispatched.KILO_BOOTLOAD_GET_PAGE, 17)
    available = Notice(Dispatched.DISPATCHER_AVAILABLE, 0xFF)
    assert encode_notice(available) == bytes([0x55, 15, 0xFF, 0xA5])
    line = b"ready\r\n\x55\x55" + encode_notice(asked) + encode_tracking(Tracking(RECORDS))
    line += encode_notice(available)
    stream, found = FromDispatcher(), []
    for byte in line:
        found += stream.take(bytes([byte]))
    assert found == [asked, Tracking(RECORDS), available]
    assert stream.junk == 9


def test_what_waits_behind_a_lost_rest_is_found_when_the_line_is_silent() -> None:
    available = Notice(Dispatched.DISPATCHER_AVAILABLE, 0xFF)
    cut = encode_tracking(Tracking(RECORDS))[:-9]
    stream = FromDispatcher()
    assert stream.take(cut + encode_notice(available)) == []
    assert stream.take_rest() == [available]
    assert stream.take_rest() == []


@given(st.binary(max_size=400))
def test_no_bytes_break_the_streams(data: bytes) -> None:
    ToDevice().take(data)
    stream = FromDispatcher()
    stream.take(data)
    stream.take_rest()
