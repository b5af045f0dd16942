"""The host's side of an overhead controller, on a pseudo terminal."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from kilotwin.errors import DeviceError
from kilotwin.files.flash_image import FlashImage
from kilotwin.table.links.overhead_robots import OverheadRobots
from kilotwin.table.links.packets import Overhead, Packet, ToDevice
from kilotwin.table.ports.pseudo_terminal import PseudoTerminal

RUN = bytes(9) + b"\x88"
IMAGE = FlashImage(bytes(range(200)))


class Steps:
    """A clock that does not wait, and the packets that had come before each of its pauses."""

    def __init__(self, terminal: PseudoTerminal) -> None:
        self._terminal, self._stream = terminal, ToDevice()
        self.now = 0.0
        self.heard: list[tuple[float, Packet]] = []

    def now_s(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        while data := self._terminal.read(0.2):
            packets = self._stream.take(data)
            self.heard += [(self.now, packet) for packet in packets]
            if packets:
                break
        self.now += seconds


@pytest.fixture
def terminal() -> Iterator[PseudoTerminal]:
    terminal = PseudoTerminal()
    yield terminal
    terminal.close()


def test_a_message_is_repeated_for_a_time_and_then_stopped(terminal: PseudoTerminal) -> None:
    clock = Steps(terminal)
    link = OverheadRobots(terminal.port, clock)
    assert (link.name, link.verifies) == (f"ohc:{terminal.port}", False)
    link.repeat(RUN, 3.0)
    link.close()
    (began, first), (ended, last) = clock.heard
    assert first == Packet(Overhead.FORWARDMSG, RUN.ljust(129, b"\0"))
    assert last == Packet(Overhead.STOP, bytes(129))
    # From when the controller has the packet, which takes 34.4 ms on the line.
    assert ended - began == pytest.approx(3.0 + 132 * 10 / 38400)


def test_an_image_is_announced_with_its_crc_and_its_pages_go_as_kilogui_sends_them(
    terminal: PseudoTerminal,
) -> None:
    clock = Steps(terminal)
    link = OverheadRobots(terminal.port, clock)
    link.announce(IMAGE)
    for page, data in enumerate(IMAGE.pages):
        link.send_page(page, data)
    assert link.ask(0, 4, 1) == []
    link.close()
    kinds = [Overhead(packet.type) for _, packet in clock.heard]
    assert kinds == [Overhead.FORWARDMSG, Overhead.STOP, Overhead.BOOTPAGE, Overhead.BOOTPAGE]
    size = clock.heard[0][1].data
    assert (size[0], size[1:3], size[9]) == (2, b"KT", 0x82)
    assert size[3:5] == IMAGE.crc16.to_bytes(2, "little")
    assert size[5:9] == IMAGE.image_id.to_bytes(4, "little")
    assert [packet.data for _, packet in clock.heard[2:]] == [
        bytes([page]) + data for page, data in enumerate(IMAGE.pages)
    ]
    # 132 bytes, then 22 frames of 130 slots of 33.6 us, for which it is deaf.
    least_s = 132 * 10 / 38400 + 22 * 130 * 33.625e-6
    assert least_s <= clock.heard[3][0] - clock.heard[2][0] < 0.140


def test_a_port_unplugged_in_mid_page_is_an_error_that_says_what_to_do() -> None:
    terminal = PseudoTerminal()
    link = OverheadRobots(terminal.port)
    pages = [0]

    def unplug() -> None:
        while pages[0] < 3:
            time.sleep(0.01)
        terminal.close()

    thread = threading.Thread(target=unplug)
    thread.start()

    def send_pages() -> None:
        while pages[0] < 20:
            link.send_page(pages[0], bytes(128))
            pages[0] += 1

    with pytest.raises(DeviceError, match=r"is gone \(.*\); plug the device in again"):
        send_pages()
    thread.join()
    link.close()


def test_two_hosts_cannot_have_one_controller(
    terminal: PseudoTerminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    link = OverheadRobots(terminal.port)
    monkeypatch.chdir(tmp_path)
    Path("ohc").symlink_to(terminal.port)
    with pytest.raises(DeviceError, match=r"\./ohc is in use by another program"):
        OverheadRobots("ohc")
    with pytest.raises(DeviceError, match=r"\./none is not there; plug it in"):
        OverheadRobots("none")
    with pytest.raises(DeviceError, match=f"{terminal.port} is in use by another program"):
        OverheadRobots(terminal.port)
    link.close()
    OverheadRobots(terminal.port).close()


def test_a_controller_that_takes_no_byte_hangs(terminal: PseudoTerminal) -> None:
    link = OverheadRobots(terminal.port)
    with pytest.raises(DeviceError, match="has taken no byte for 2 s: the device hangs"):
        link._port.write(bytes(1_000_000))
    link.close()
