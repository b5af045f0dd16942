"""A module takes all that the host sends: whole transfers between Python and C, with loss,
repetition and reordering in between."""

import ctypes
from collections.abc import Sequence

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from kilotwin.files.flash_image import FlashImage
from kilotwin.files.message_crc import message_crc
from kilotwin.table.can import transfer
from kilotwin.table.can.protocol import FrameError

from .c_protocol import Receiver

IMAGES = st.binary(min_size=1, max_size=600)


def send(receiver: Receiver, frames: Sequence[bytes]) -> list[str]:
    return [receiver.receive(frame) for frame in frames]


@given(data=st.binary(min_size=1, max_size=48))
def test_a_configuration_arrives_as_it_was_sent(protocol_c: ctypes.CDLL, data: bytes) -> None:
    module = Receiver(protocol_c)
    events = send(module, [frame.data for frame in transfer.configuration(data)])
    assert (events[0], events[-1]) == ("CONFIG_BEGUN", "CONFIG_DONE")
    assert set(events[1:-1]) <= {"GOES_ON"}
    assert bytes(module.state.config.data)[: module.state.config.size] == data


@given(data=st.binary(min_size=9, max_size=9), kind=st.integers(0, 255))
def test_an_infrared_message_arrives_as_it_was_sent(
    protocol_c: ctypes.CDLL, data: bytes, kind: int
) -> None:
    module = Receiver(protocol_c)
    events = send(module, [frame.data for frame in transfer.infrared(data, kind)])
    assert events == ["GOES_ON", "IR_DONE"]
    assert (bytes(module.state.ir.data), module.state.ir.type) == (data, kind)


@given(image=IMAGES)
def test_a_program_for_the_robots_arrives_page_by_page(
    protocol_c: ctypes.CDLL, image: bytes
) -> None:
    module = Receiver(protocol_c)
    pages: list[bytes] = []
    for frame in transfer.kilobot_program(image):
        if module.receive(frame.data) == "PAGE_DONE":
            assert module.state.kilo.page == len(pages)
            pages.append(bytes(module.state.kilo.data))
            assert frame.pause_s > 0.05, "the module needs time to send the page"
    assert pages == transfer.pages_of(image)
    assert b"".join(pages).rstrip(b"\xff") == image.rstrip(b"\xff")


@given(image=IMAGES, old_loader=st.booleans())
def test_a_program_for_the_module_arrives_page_by_page(
    protocol_c: ctypes.CDLL, image: bytes, old_loader: bool
) -> None:
    module = Receiver(protocol_c)
    pages: list[bytes] = []
    for frame in transfer.module_program(image, old_loader=old_loader):
        if module.receive(frame.data) == "OWN_PAGE_DONE":
            pages.append(bytes(module.state.own.data))
    assert pages == transfer.pages_of(image)
    assert module.own_pages_missing() == 0


@given(image=IMAGES)
def test_an_image_is_announced_with_what_it_is_checked_by(
    protocol_c: ctypes.CDLL, image: bytes
) -> None:
    whole = FlashImage(image)
    check = whole.crc16.to_bytes(2, "little") + whole.image_id.to_bytes(4, "little")
    for frames, program in (
        (transfer.kilobot_program, "kilo"),
        (transfer.module_program, "own"),
    ):
        module = Receiver(protocol_c)
        first, *rest = [frame.data for frame in frames(whole)]
        assert rest == [frame.data for frame in frames(image)], "an original takes the rest"
        send(module, [first, rest[0]])
        announced = getattr(module.state, program)
        assert (announced.checked, bytes(announced.check)) == (True, check)
        assert announced.pages == len(whole.pages)
        send(module, [rest[0]])
        assert not announced.checked, "the next announcement is another sender's"


def test_the_frames_of_a_configuration_are_these_bytes() -> None:
    frames = [frame.data.hex(" ") for frame in transfer.configuration(bytes(range(1, 9)))]
    assert frames == [
        "0f 00 08 00 00 00 00 00",
        "10 00 01 02 03 04 05 06",
        "10 01 07 08 00 00 00 00",
    ]


def test_the_last_of_22_chunks_holds_two_bytes_of_the_page() -> None:
    frames = list(transfer.kilobot_program(bytes(range(128))))
    assert [frame.data[0] for frame in frames] == [0x04, 0x05, *[0x03] * 22]
    assert [frame.data[1] for frame in frames[2:]] == list(range(22))
    assert frames[-1].data == bytes([0x03, 21, 126, 127, 0, 0, 0, 0])
    old = list(transfer.module_program(bytes(128)))
    assert [frame.data[0] for frame in old] == [0xA7, 0xA8, *[0xA6] * 22]


def test_checks_of_three_pages_and_questions_are_these_bytes() -> None:
    image = FlashImage(bytes(3 * 128) + bytes(range(128)) + bytes(5))
    assert transfer.modules_page_crcs(image, 0).data.hex(" ") == "16 00 0f 50 0f 50 0f 50"
    fourth, fifth = (f"{message_crc(page):04x}" for page in image.pages[3:])
    words = " ".join(crc[2:] + " " + crc[:2] for crc in (fourth, fifth))
    assert transfer.modules_page_crcs(image, 3).data.hex(" ") == f"16 03 {words} 00 00"
    assert transfer.modules_boot_query(0xE0).data.hex(" ") == "17 e0 00 00 00 00 00 00"


def test_frames_are_paced_as_the_original_dispatcher_paces_them() -> None:
    assert all(frame.pause_s >= 0.005 for frame in transfer.infrared(bytes(9), 0))
    assert all(frame.pause_s == 0.005 for frame in transfer.configuration(bytes(48)))
    pauses = [frame.pause_s for frame in transfer.kilobot_program(bytes(128))]
    assert pauses == [0.010, 0.010, *[0.001] * 21, 0.100]


@pytest.mark.parametrize("size", [0, 49])
def test_a_configuration_of_no_or_too_many_bytes_is_not_sent(size: int) -> None:
    with pytest.raises(FrameError, match=f"1 to 48 bytes, not {size}"):
        transfer.configuration(bytes(size))


def test_what_cannot_be_sent_is_refused() -> None:
    with pytest.raises(FrameError, match="28160 bytes, not 28161"):
        transfer.pages_of(bytes(28161))
    with pytest.raises(FrameError, match="not 0"):
        list(transfer.kilobot_program(b""))
    with pytest.raises(FrameError, match="9 data bytes, not 8"):
        transfer.infrared(bytes(8), 0)
    with pytest.raises(FrameError, match="FORWARD_IR_MESSAGE"):
        transfer.infrared(bytes(9), 256)


def on_the_way(draw: st.DrawFn, frames: list[bytes]) -> tuple[list[bytes], bool]:
    """The frames as a bad wire brings them, and whether they are still all there in order."""
    arrived = list(frames)
    for _ in range(draw(st.integers(1, 4))):
        if not arrived:
            break
        at = draw(st.integers(0, len(arrived) - 1))
        match draw(st.sampled_from(["lose", "repeat", "swap"])):
            case "lose":
                del arrived[at]
            case "repeat":
                arrived.insert(at, arrived[at])
            case "swap":
                # With its neighbour: no wire brings a chunk a whole page late.
                other = min(at + 1, len(arrived) - 1)
                arrived[at], arrived[other] = arrived[other], arrived[at]
    return arrived, arrived == frames


@st.composite
def bad_configurations(draw: st.DrawFn) -> tuple[bytes, list[bytes], bool]:
    # Bytes that differ from one another, so that no swap goes unseen.
    size = draw(st.integers(1, 48))
    data = bytes(range(1, size + 1))
    frames, whole = on_the_way(draw, [frame.data for frame in transfer.configuration(data)])
    return data, frames, whole


@given(sent=bad_configurations())
def test_a_configuration_on_a_bad_wire_is_taken_whole_or_not_at_all(
    protocol_c: ctypes.CDLL, sent: tuple[bytes, list[bytes], bool]
) -> None:
    data, frames, whole = sent
    module = Receiver(protocol_c)
    for frame in frames:
        if module.receive(frame) == "CONFIG_DONE":
            assert bytes(module.state.config.data)[: module.state.config.size] == data
    if whole:
        assert module.state.dropped.out_of_order == 0
    # Sent again, it arrives.
    again = send(module, [frame.data for frame in transfer.configuration(data)])
    assert again[-1] == "CONFIG_DONE"
    assert bytes(module.state.config.data)[: module.state.config.size] == data


@st.composite
def bad_programs(draw: st.DrawFn) -> tuple[bytes, list[bytes]]:
    image = bytes(draw(st.permutations(range(256))))
    frames, _ = on_the_way(draw, [frame.data for frame in transfer.kilobot_program(image)])
    return image, frames


@given(sent=bad_programs())
def test_a_page_on_a_bad_wire_is_taken_whole_or_not_at_all(
    protocol_c: ctypes.CDLL, sent: tuple[bytes, list[bytes]]
) -> None:
    image, frames = sent
    module, pages = Receiver(protocol_c), transfer.pages_of(image)
    numbers = [frame[2] for frame in frames if frame[0] == 0x05]
    for frame in frames:
        if module.receive(frame) == "PAGE_DONE":
            # A page's number frame may be lost or have gone astray; the bytes are a page's.
            assert bytes(module.state.kilo.data) in pages
            assert module.state.kilo.page in numbers
    done = [module.receive(frame.data) for frame in transfer.kilobot_program(image)]
    assert done.count("PAGE_DONE") == 2


@example(image=list(range(256)), lost={23, 24})  # a page's last chunk and the next one's number
@given(image=st.permutations(range(256)), lost=st.sets(st.integers(0, 48), max_size=5))
def test_laps_fill_in_what_was_lost_of_a_program_for_the_module(
    protocol_c: ctypes.CDLL, image: list[int], lost: set[int]
) -> None:
    module = Receiver(protocol_c)
    pages: dict[int, bytes] = {}
    frames = [frame.data for frame in transfer.module_program(bytes(image))]
    for lap in range(2):
        for number, frame in enumerate(frames):
            if (lap == 0 and number in lost) or module.receive(frame) != "OWN_PAGE_DONE":
                continue
            assert module.state.own.page not in pages, "each page once"
            pages[module.state.own.page] = bytes(module.state.own.data)
    assert module.own_pages_missing() == 0
    assert [pages[0], pages[1]] == transfer.pages_of(bytes(image))
