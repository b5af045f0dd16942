"""Robots through a grid's modules, over buses that the test holds in its hand."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from kilotwin.errors import DeviceError, InputError
from kilotwin.experiment.spec.grid_layout import Layout
from kilotwin.experiment.spec.overhead import RUN
from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import BOOT_IDENTITY, VITALS
from kilotwin.table.can.protocol import to_module, types_to_host
from kilotwin.table.grid import frames as wire
from kilotwin.table.grid.cover import Group
from kilotwin.table.grid.links import FRAME, NO_FRAMES, Frames
from kilotwin.table.links.grid_robots import GridRobots, open_grid
from kilotwin.table.links.robot_link import RobotState

LAYOUT = Layout(2, 2, 2)


class Clock:
    """Time that passes when its user sleeps."""

    def __init__(self) -> None:
        self.time_s = 100.0

    def now_s(self) -> float:
        return self.time_s

    def sleep(self, seconds: float) -> None:
        self.time_s += max(0.0, seconds)


class Buses:
    """Buses that hand back what was sent, as python-can's do, and what `incoming` holds."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.sent: list[tuple[float, int, int, bytes]] = []
        self.rows: list[tuple[object, ...]] = []
        self.full_until_s = 0.0
        self.why: str | None = None
        self.closed = False
        self.on_send: Callable[[int, bytes], None] = lambda bus, data: None

    def __len__(self) -> int:
        return LAYOUT.buses

    def put(self, bus: int, identifier: int, data: bytes, *, from_host: bool = False) -> None:
        padded = list(data.ljust(8, b"\0"))
        now_s = self.clock.time_s
        self.rows.append((now_s, bus, identifier, len(data), padded, from_host))

    def send(self, bus: int, identifier: int, data: bytes, now_s: float) -> bool:
        if now_s < self.full_until_s:
            return False
        self.sent.append((now_s, bus, identifier, bytes(data)))
        self.put(bus, identifier, data, from_host=True)
        self.on_send(bus, bytes(data))
        return True

    def send_all(self, bus: int, identifiers: Sequence[int], data: bytes, now_s: float) -> int:
        return sum(self.send(bus, identifier, data, now_s) for identifier in identifiers)

    def trouble(self, bus: int) -> str | None:
        return self.why if bus == 1 else None

    def receive(self, now_s: float) -> Frames:
        rows, self.rows = self.rows, []
        return np.array(rows, dtype=FRAME) if rows else NO_FRAMES

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def buses(clock: Clock) -> Buses:
    return Buses(clock)


@pytest.fixture
def robots(clock: Clock, buses: Buses) -> GridRobots:
    made = GridRobots(LAYOUT, buses, clock)
    buses.sent.clear()
    return made


def report(cell: int, uid: int, content: bytes, state: int) -> bytes:
    kind = types_to_host()["ROBOT_REPORT"] | cell << 6
    return bytes([kind]) + uid.to_bytes(2, "little") + content + bytes([state])


def test_a_message_is_repeated_by_all_modules_between_two_stops(
    robots: GridRobots, buses: Buses
) -> None:
    robots.repeat(RUN, 3.0)
    assert {bus for _, bus, _, _ in buses.sent} == {0, 1}
    assert {identifier for _, _, identifier, _ in buses.sent} == {0}
    on_one = [(at_s, data) for at_s, bus, _, data in buses.sent if bus == 0]
    stop = wire.fixed().STOP
    assert [data for _, data in on_one] == [stop, *(f.data for f in wire.forward(RUN)), stop]
    assert on_one[3][0] - on_one[2][0] >= 3.0


def test_an_image_is_announced_with_its_check_first(robots: GridRobots, buses: Buses) -> None:
    image = FlashImage(bytes(200))
    robots.announce(image)
    check = {"ImageCrc": image.crc16, "ImageId": image.image_id}
    assert [data for _, bus, _, data in buses.sent if bus == 1] == [
        to_module("KILO_BOOTPAGE_SIZE", SizePart=1, **check),
        to_module("KILO_BOOTPAGE_SIZE", SizePart=0, Pages=2),
    ]


def test_a_page_goes_to_all_buses_at_a_pace_that_modules_keep(
    robots: GridRobots, buses: Buses, clock: Clock
) -> None:
    robots.send_page(7, bytes(range(128)))
    frames = [(at_s, data) for at_s, bus, _, data in buses.sent if bus == 0]
    assert len(frames) == 23
    assert len(buses.sent) == 46
    gaps = np.diff([at_s for at_s, _ in frames])
    assert gaps.min() >= 0.001
    assert clock.time_s - frames[-1][0] >= 0.0999


def test_answers_come_with_the_cell_that_heard_them(robots: GridRobots, buses: Buses) -> None:
    def answer(bus: int, data: bytes) -> None:
        asked = to_module("ROBOT_QUERY", First=VITALS, SlotsLog2=3, Nonce=9, Uid=0xFFFF)
        assert data == asked
        content = bytes([683 & 255, 0, 0, 683 >> 8 << 6])
        buses.put(bus, wire.id_from_module((bus, bus)), report(3, 40 + bus, content, 0x12))

    buses.on_send = answer
    found = robots.ask(VITALS, 3, 9)
    assert [(r.uid, r.module, r.cell) for r in found] == [(40, (0, 0), 3), (41, (1, 1), 3)]
    assert found[0].voltage == 683
    assert found[0].robot_state is RobotState.RUNNING


def test_the_question_is_waited_for_up_to_its_last_slot(robots: GridRobots, clock: Clock) -> None:
    began_s = clock.time_s
    assert robots.ask(BOOT_IDENTITY, 6, 1) == []
    assert clock.time_s - began_s >= 64 * 0.015
    middle_s = clock.time_s
    robots.ask(VITALS, 6, 1)
    assert clock.time_s - middle_s >= 64 * 0.032768


def test_old_answers_and_other_frames_are_no_answers(robots: GridRobots, buses: Buses) -> None:
    sender = wire.id_from_module((0, 0))
    good = report(0, 5, bytes(4), 2)
    buses.put(0, sender, good)

    def chatter(bus: int, data: bytes) -> None:
        buses.put(bus, sender, good[:5])
        buses.put(bus, wire.id_from_module((1, 9)), good)
        buses.put(bus, 1, good)
        buses.put(bus, sender, bytes([types_to_host()["TRACKING_KILOBOT"], *bytes(7)]))

    buses.on_send = chatter
    assert robots.ask(0, 0, 1) == []


@pytest.mark.parametrize("from_host", [False, True])
def test_another_host_is_noticed_before_anything_is_sent(
    from_host: bool, buses: Buses, clock: Clock
) -> None:
    """As another machine's frames come, and as those of another program of this one."""
    buses.put(1, 0, wire.fixed().RUN, from_host=from_host)
    with pytest.raises(DeviceError, match=r"--can b: another host gives orders there .MODULE_RUN"):
        GridRobots(LAYOUT, buses, clock, ["a", "b"])
    assert buses.sent == []


def test_another_host_is_noticed_in_the_middle(robots: GridRobots, buses: Buses) -> None:
    buses.put(0, wire.id_of_group(Group(0, 0)), wire.fixed().TRACKING_REQUEST)
    with pytest.raises(DeviceError, match="another host gives orders there"):
        robots.send_page(0, bytes(128))


def test_programs_of_modules_may_talk_to_one_another(robots: GridRobots, buses: Buses) -> None:
    buses.put(0, wire.id_of_group(Group(1, 0)), bytes(8))
    robots.send_page(0, bytes(128))


def test_a_queue_that_is_full_for_a_moment_is_waited_for(
    robots: GridRobots, buses: Buses, clock: Clock
) -> None:
    buses.full_until_s = clock.time_s + 0.2
    robots.send_page(0, bytes(128))
    assert len(buses.sent) == 46


def test_a_queue_that_stays_full_is_a_bus_that_fails(
    robots: GridRobots, buses: Buses, clock: Clock
) -> None:
    buses.full_until_s = clock.time_s + 10
    with pytest.raises(DeviceError, match="--can can0: its queue stays full"):
        robots.send_page(0, bytes(128))


def test_a_bus_that_fails_is_named(robots: GridRobots, buses: Buses) -> None:
    buses.why = "network is down"
    with pytest.raises(DeviceError, match="--can can1: network is down"):
        robots.ask(0, 0, 1)
    with pytest.raises(DeviceError, match="--can can1: network is down"):
        robots.repeat(RUN, 0.1)


def test_it_leaves_the_buses(robots: GridRobots, buses: Buses) -> None:
    robots.close()
    assert buses.closed


def test_a_grid_without_buses_is_refused() -> None:
    with pytest.raises(InputError, match="on which CAN bus"):
        open_grid([], "2x2")
