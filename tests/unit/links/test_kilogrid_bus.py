"""The dispatcher as an interface of python-can, against the emulated one on a pseudo terminal."""

import errno
import threading
import time
from collections.abc import Callable, Iterator

import can
import pytest

from kilotwin.errors import DeviceError, InputError
from kilotwin.files.flash_image import FlashImage
from kilotwin.table.can.address import ALL_MODULES, column, module, to_id
from kilotwin.table.can.buses import name_all, open_all
from kilotwin.table.can.protocol import health_request, to_module
from kilotwin.table.can.transfer import (
    configuration,
    infrared,
    modules_announcement,
    modules_page,
    robots_announcement,
    robots_page,
)
from kilotwin.table.links import kilogrid_bus
from kilotwin.table.links.dispatcher_robots import DispatcherRobots, parse_port
from kilotwin.table.links.emulated_dispatcher import EmulatedDispatcher, ToModules
from kilotwin.table.links.grid_robots import open_grid
from kilotwin.table.links.kilogrid_bus import KilogridBus
from kilotwin.table.ports.pseudo_terminal import PseudoTerminal

pytestmark = pytest.mark.waits

STEP_S = 0.032768
IDLE, RUN = to_module("MODULE_IDLE"), to_module("MODULE_RUN")
POLL = to_module("TRACKING_REQ")


class Device:
    """A dispatcher with modules, in a thread; its time goes ten times as fast as the wall's."""

    def __init__(self) -> None:
        self.terminal = PseudoTerminal()
        self.device = EmulatedDispatcher()
        self.frames: list[ToModules] = []
        self.reports: dict[tuple[int, int], list[bytes]] = {}
        self.dead: set[tuple[int, int]] = set()
        self.polls = 0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        self.terminal.close()

    def _serve(self) -> None:
        now_s = 0.0
        while not self._ended.is_set():
            while data := self.terminal.read(0):
                self.device.take(data)
            frames, said = self.device.step(now_s, now_s + STEP_S)
            self.terminal.write(said)
            now_s += STEP_S
            for _, frame in frames:
                if frame.data == POLL:
                    self.polls += 1
                    self._answer((frame.address.x, frame.address.y), now_s)
                else:
                    self.frames.append(frame)
            time.sleep(STEP_S / 10)

    def _answer(self, asked: tuple[int, int], now_s: float) -> None:
        if asked in self.dead:
            return
        reports = self.reports.pop(asked, [])
        self.device.hear(asked, bytes([0x14, len(reports)]), now_s)
        for report in reports:
            self.device.hear(asked, report, now_s)

    def has(self, *frames: bytes) -> None:
        """Waits until these have come to all modules, in this order and nothing else."""
        self.has_frames([ToModules(ALL_MODULES, frame) for frame in frames])

    def has_frames(self, frames: list[ToModules]) -> None:
        wait(lambda: len(self.frames) >= len(frames))
        assert self.frames == frames
        self.frames = []


def wait(ready: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 600
    while not ready():
        assert time.monotonic() < deadline
        time.sleep(0.002)


@pytest.fixture
def device() -> Iterator[Device]:
    device = Device()
    yield device
    device.close()


@pytest.fixture
def bus(device: Device) -> Iterator[KilogridBus]:
    bus = KilogridBus(device.terminal.port, size=(2, 2))
    yield bus
    bus.shutdown()


def send(bus: can.BusABC, data: bytes, identifier: int = to_id(ALL_MODULES)) -> None:
    """As the controller does: again while the queue is full."""
    deadline = time.monotonic() + 600
    while True:
        assert time.monotonic() < deadline
        try:
            message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
            return bus.send(message)
        except can.CanOperationError as error:
            if error.error_code != errno.ENOBUFS:
                raise
        time.sleep(0.001)


def pump(bus: can.BusABC, ready: Callable[[], bool]) -> list[can.Message]:
    """Receives until something is so."""
    found: list[can.Message] = []

    def look() -> bool:
        while message := bus.recv(0):
            found.append(message)
        return ready()

    wait(look)
    return found


def test_orders_become_packets_and_frames_again(device: Device, bus: KilogridBus) -> None:
    message = [frame.data for frame in infrared(bytes(range(9)), 0x85)]
    orders = [to_module("FORWARD_IR_MESSAGE_STOP"), *message, to_module("MODULE_SETUP")]
    for frame in orders:
        send(bus, frame)
    send(bus, IDLE)
    pump(bus, lambda: len(device.frames) == 6)
    device.has(*orders, IDLE, b"\xaa" + bytes(7))
    assert bus.dropped == 0


def test_a_configuration_is_collected_for_its_address(device: Device, bus: KilogridBus) -> None:
    wanted = []
    for address in (module(1, 0), column(1)):
        frames = configuration(bytes(range(1, 9)))
        for frame in frames:
            send(bus, frame.data, to_id(address))
        wanted += [ToModules(address, frame.data) for frame in frames]
    pump(bus, lambda: len(device.frames) == 6)
    device.has_frames(wanted)
    # One with a chunk lost is not passed on.
    first, _, last = configuration(bytes(range(1, 9)))
    for frame in (first, last):
        send(bus, frame.data, to_id(module(0, 0)))
    assert bus.dropped == 1


def test_what_it_has_no_packet_for_is_dropped(device: Device, bus: KilogridBus) -> None:
    send(bus, health_request())
    send(bus, RUN, to_id(module(0, 0)))
    send(bus, infrared(bytes(9), 0x85)[1].data)
    send(bus, b"\x00ownframe"[:8])
    assert bus.dropped == 4
    assert device.frames == []


def report(robot: int, cell: int) -> bytes:
    return bytes([0x11 | cell << 6, robot, 1, 2, 3, 4, 5, 6])


def test_polls_are_answered_from_the_reports_that_have_come(
    device: Device, bus: KilogridBus
) -> None:
    sent = [report(robot, 3) for robot in range(10)]
    device.reports = {(1, 1): list(sent)}
    send(bus, RUN)
    pump(bus, lambda: not device.reports and bool(bus._records))
    assert bus.running
    send(bus, POLL, to_id(module(1, 1)))
    send(bus, POLL, to_id(module(0, 1)))
    found = pump(bus, lambda: True)
    own, other = to_id(module(1, 1)) | 1, to_id(module(0, 1)) | 1
    assert [(m.arbitration_id, bytes(m.data)) for m in found] == [
        (own, bytes([0x14, 10])),
        *((own, data) for data in sent),
        (other, bytes([0x14, 0])),
    ]
    # It says CONTINUE, or the dispatcher would poll no more.
    polls = device.polls
    pump(bus, lambda: device.polls > polls + 100)


def test_orders_wait_until_it_is_available_and_the_last_reports_come_by_themselves(
    device: Device, bus: KilogridBus
) -> None:
    send(bus, RUN)
    pump(bus, lambda: device.polls > 20)
    for frame in infrared(bytes(9), 0x85):
        send(bus, frame.data)
    for frame in configuration(b"\x07"):
        send(bus, frame.data)
    pump(bus, lambda: len(device.frames) == 5)
    device.reports = {(0, 0): [report(4, 1)]}
    pump(bus, lambda: not device.reports)
    # STOP ends the polling, as IDLE does.
    send(bus, to_module("FORWARD_IR_MESSAGE_STOP"))
    found = pump(bus, lambda: not bus.running and not device.device.running)
    found += pump(bus, lambda: len(device.frames) == 7)
    while len(found) < 2:
        found += pump(bus, lambda: True)
    assert [bytes(m.data) for m in found] == [bytes([0x14, 1]), report(4, 1)]
    message = [frame.data for frame in infrared(bytes(9), 0x85)]
    set_up = [frame.data for frame in configuration(b"\x07")]
    device.has(RUN, *message, *set_up, IDLE, b"\xaa" + bytes(7))


def test_a_dispatcher_that_a_dead_module_holds_up_can_be_stopped(
    device: Device, bus: KilogridBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kilogrid_bus, "_STUCK_S", 3)
    device.dead = {(1, 1)}
    send(bus, RUN)
    pump(bus, lambda: device.polls > 3)
    send(bus, IDLE)
    pump(bus, lambda: not device.device.running)
    pump(bus, lambda: len(device.frames) >= 4)
    # RUN has it begin anew; then it takes the order.
    device.has(RUN, RUN, IDLE, b"\xaa" + bytes(7))


IMAGE = FlashImage(bytes(range(200)))


def test_a_program_for_robots_goes_page_by_page_as_it_is_asked_for(
    device: Device, bus: KilogridBus
) -> None:
    size = [frame.data for frame in robots_announcement(IMAGE)]
    pages = [f.data for n, page in enumerate(IMAGE.pages) for f in robots_page(n, page)]
    for frame in (*size, *pages):
        send(bus, frame)
    pump(bus, lambda: len(device.frames) == 47)
    # Part 1 of the announcement, with the CRC, is not passed on.
    device.has(size[1], *pages)
    assert bus.dropped == 1


def test_a_program_for_modules_goes_in_the_numbers_of_old_loaders(
    device: Device, bus: KilogridBus
) -> None:
    def frames(*, old: bool) -> list[bytes]:
        size = [frame.data for frame in modules_announcement(IMAGE, old_loader=old)]
        pages = enumerate(IMAGE.pages)
        return size + [
            frame.data for page in pages for frame in modules_page(*page, old_loader=old)
        ]

    for old in (False, True):
        for frame in frames(old=old):
            send(bus, frame)
        pump(bus, lambda: len(device.frames) == 47)
        device.has(*frames(old=True)[1:])


def test_a_port_that_is_gone_is_an_error_of_the_bus() -> None:
    terminal = PseudoTerminal()
    bus = KilogridBus(terminal.port)
    terminal.close()
    with pytest.raises(can.CanOperationError, match=r"is gone .*; plug the device in again"):
        bus.recv(0.5)
    with pytest.raises(can.CanOperationError, match="is gone"):
        bus.send(can.Message(arbitration_id=0, data=RUN, is_extended_id=False))
    bus.shutdown()
    bus.shutdown()


def test_one_dispatcher_is_named_for_all_buses(device: Device) -> None:
    name = f"kilogrid:{device.terminal.port}@38400"
    (named,) = name_all([name], 4, (10, 20))
    assert (str(named), named.size) == (name, (10, 20))
    (opened,) = open_all([named])
    assert isinstance(opened.bus, KilogridBus)
    with pytest.raises(DeviceError, match="is in use by"):
        open_all([named])
    opened.bus.shutdown()
    with pytest.raises(InputError, match="a dispatcher has all buses; name nothing else"):
        name_all([name, "socketcan:can0"], 2, (10, 20))
    with pytest.raises(DeviceError, match="none is not there; plug it in"):
        open_all(name_all(["kilogrid:/none"], 1, (10, 20)))


def test_robots_answers_do_not_come_through_a_dispatcher() -> None:
    said = "no answers come through a dispatcher; use --via dispatcher:/dev/x"
    with pytest.raises(InputError, match=said):
        open_grid(["kilogrid:/dev/x"], "4x4")


@pytest.mark.parametrize("text", ["@38400", "/dev/x@fast", "/dev/x@0"])
def test_a_baud_rate_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"not PORT\[@BAUD\]; try /dev/ttyUSB0@38400"):
        parse_port(text)


def test_robots_get_messages_and_pages_by_the_dispatcher(device: Device) -> None:
    link = DispatcherRobots(device.terminal.port)
    assert (link.verifies, link.laps_per_place) == (False, 4)
    boot = bytes(9) + b"\x80"
    link.repeat(boot, 0.1)
    for _ in range(2):
        link.announce(IMAGE)
        for number, page in enumerate(IMAGE.pages):
            link.send_page(number, page)
    assert link.ask(0, 4, 1) == []
    link.close()
    wait(lambda: device.frames[-1].data == to_module("FORWARD_IR_MESSAGE_STOP"))
    pages = [f.data for n, page in enumerate(IMAGE.pages) for f in robots_page(n, page)]
    device.has(
        *(IDLE, b"\xaa" + bytes(7)),
        *(frame.data for frame in infrared(bytes(9), 0x80)),
        to_module("FORWARD_IR_MESSAGE_STOP"),
        to_module("KILO_BOOTPAGE_SIZE", SizePart=0, Pages=2),
        *pages * 2,
        to_module("FORWARD_IR_MESSAGE_STOP"),
    )


def test_a_dispatcher_that_asks_for_no_page_is_named_with_its_baud_rate(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("kilotwin.table.links.dispatcher_robots._REQUEST_S", 0.1)
    terminal = PseudoTerminal()
    link = DispatcherRobots(terminal.port)
    with pytest.raises(DeviceError, match=r"asks for no page; .* 256000 baud\? .*@38400"):
        link.announce(IMAGE)
    terminal.close()
    link.close()
