"""The emulated overhead controller: which frames come of which packets, and when."""

import itertools

import pytest

from kilotwin.files.message_crc import message_crc
from kilotwin.table.links.emulated_overhead import EmulatedOverhead, Frame
from kilotwin.table.links.packets import Overhead, encode, encode_page

RUN = bytes(9) + b"\x88"
STEP_S = 0.032768


def frames_of(controller: EmulatedOverhead, seconds: float, begin_s: float = 0.0) -> list[Frame]:
    """Frames that begin within so many seconds, asked for step by step."""
    found = []
    for step in range(round(seconds / STEP_S)):
        at = begin_s + step * STEP_S
        found += controller.frames(at, at + STEP_S)
    return found


def gaps(frames: list[Frame]) -> list[float]:
    return [b[0] - a[0] for a, b in itertools.pairwise(frames)]


def test_a_message_is_repeated_each_10_ms_until_the_next_packet() -> None:
    controller = EmulatedOverhead()
    assert frames_of(controller, 1) == []
    controller.take(encode(Overhead.FORWARDMSG, RUN), 1.0)
    frames = frames_of(controller, 1, 1)
    assert {frame for _, frame in frames} == {RUN + b"\xc7\x94"}
    assert gaps(frames) == pytest.approx([0.0104] * len(gaps(frames)))
    assert len(frames) in (97, 98)
    controller.take(encode(Overhead.STOP), 2.0)
    assert frames_of(controller, 1, 2) == []
    assert controller.packets == 2


def test_a_message_may_be_sent_once() -> None:
    controller = EmulatedOverhead()
    controller.take(encode(Overhead.FORWARDMSGSINGLE, RUN), 0.0)
    assert [frame for _, frame in frames_of(controller, 1)] == [RUN + b"\xc7\x94"]


def test_a_raw_message_has_the_crc_that_it_is_given() -> None:
    controller = EmulatedOverhead()
    controller.take(encode(Overhead.FORWARDRAWMSG, RUN + b"\x12\x34"), 0.0)
    assert {frame for _, frame in frames_of(controller, 0.1)} == {RUN + b"\x12\x34"}


def test_a_page_is_22_frames_back_to_back() -> None:
    controller = EmulatedOverhead()
    page = bytes(range(1, 129))
    controller.take(encode_page(Overhead.BOOTPAGE, 7, page), 0.0)
    frames = frames_of(controller, 1)
    assert len(frames) == 22
    assert gaps(frames) == pytest.approx([130 * 33.625e-6 + 80e-6] * 21)
    assert frames[-1][0] + 0.0044 < 0.130 - 132 * 10 / 38400 + 0.005
    got = b""
    for number, (_, frame) in enumerate(frames):
        assert frame[0] == 7
        assert frame[1] == 3 * number
        assert frame[9] == 0x81
        assert frame[10:] == message_crc(frame[:10]).to_bytes(2, "little")
        got += frame[2:8]
    assert got == page + bytes(4)


def test_what_comes_during_a_page_waits_for_its_turn() -> None:
    controller = EmulatedOverhead()
    controller.take(encode_page(Overhead.BOOTPAGE, 0, bytes(128)), 0.0)
    assert len(controller.frames(0, STEP_S)) == 8
    controller.take(encode_page(Overhead.BOOTPAGE, 1, bytes(128)), 0.0)
    controller.take(encode(Overhead.FORWARDMSGSINGLE, RUN), 0.0)
    frames = frames_of(controller, 1, STEP_S)
    assert [frame[0] for _, frame in frames] == [0] * 14 + [1] * 22 + [0]
    assert frames[-1][1][9] == 0x88
    # It blinks for 20 ms after each page.
    assert max(gaps(frames)) == pytest.approx(0.020 + 130 * 33.625e-6 + 80e-6)


def test_a_packet_takes_its_time_on_the_line_however_fast_its_bytes_come() -> None:
    controller = EmulatedOverhead()
    controller.take(encode(Overhead.FORWARDMSG, RUN) + encode(Overhead.STOP), 0.0)
    assert len(frames_of(controller, 1)) == 4
    controller.take(encode(Overhead.STOP) + encode(Overhead.FORWARDMSGSINGLE, RUN), 1.0)
    assert frames_of(controller, 1, 1)[0][0] == pytest.approx(1 + 132 * 10 / 38400)


def test_positions_are_sent_up_to_the_record_of_zeros() -> None:
    controller = EmulatedOverhead()
    controller.take(encode(Overhead.GPSFRAME, bytes(range(1, 25)) + bytes(8) + bytes([9] * 8)), 0.0)
    frames = [frame for _, frame in frames_of(controller, 1)]
    assert [frame[:8] for frame in frames] == [bytes(range(n, n + 8)) for n in (1, 9, 17)]
    assert {frame[9] for frame in frames} == {1}
    controller.take(encode(Overhead.GPSFRAME, bytes([1] * 129)), 0.0)
    assert len(frames_of(controller, 1, 1)) == 16


def test_types_that_do_nothing_end_what_is_repeated() -> None:
    controller = EmulatedOverhead()
    controller.take(encode(Overhead.FORWARDMSG, RUN) + encode(Overhead.LEDTOGGLE) + b"junk", 0.0)
    assert len(frames_of(controller, 1)) == 4
    controller.take(encode(Overhead.FORWARDMSG, RUN), 1.0)
    assert frames_of(controller, 0.1, 1) != []
    assert controller.junk == 4
