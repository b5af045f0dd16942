"""The emulated dispatcher: what it makes of packets, how it polls, and what holds it up."""

import pytest

from kilotwin.table.can.address import ALL_MODULES, Address, AddressType, module
from kilotwin.table.can.protocol import to_module
from kilotwin.table.can.transfer import configuration, infrared, modules_page, robots_page
from kilotwin.table.links.emulated_dispatcher import EmulatedDispatcher, ToModules
from kilotwin.table.links.packets import (
    CONTINUE,
    Dispatched,
    FromDispatcher,
    GridCommand,
    Notice,
    Tracking,
    encode,
    encode_page,
)

STEP_S = 0.032768
AVAILABLE = Notice(Dispatched.DISPATCHER_AVAILABLE, 0xFF)


class Table:
    """A dispatcher and its modules, step by step; modules of `dead` answer nothing."""

    def __init__(self) -> None:
        self.device = EmulatedDispatcher()
        self.now_s = 0.0
        self.frames: list[tuple[float, ToModules]] = []
        self.said: list[tuple[float, Notice | Tracking]] = []
        self.reports: dict[tuple[int, int], list[bytes]] = {}
        self.dead: set[tuple[int, int]] = set()
        self._stream = FromDispatcher()

    def step(self, count: int = 1) -> None:
        for _ in range(count):
            frames, said = self.device.step(self.now_s, self.now_s + STEP_S)
            self.frames += frames
            self.said += [(self.now_s, packet) for packet in self._stream.take(said)]
            self.now_s += STEP_S
            for _, frame in frames:
                if frame.data == to_module("TRACKING_REQ"):
                    self._answer((frame.address.x, frame.address.y))

    def _answer(self, asked: tuple[int, int]) -> None:
        if asked in self.dead:
            return
        reports = self.reports.pop(asked, [])
        self.device.hear(asked, bytes([0x14, len(reports)]), self.now_s)
        for report in reports:
            self.device.hear(asked, report, self.now_s)

    def tell(self, kind: int, *data: int) -> None:
        self.device.take(encode(kind, bytes(data)))

    def passed_on(self) -> list[Tracking]:
        return [packet for _, packet in self.said if isinstance(packet, Tracking)]

    def command(self, command: int, *more: int) -> None:
        self.tell(Dispatched.KILOGRID_COMMAND, command, *more)

    def sent(self) -> list[ToModules]:
        frames = [frame for _, frame in self.frames]
        self.frames = []
        return frames

    def polled(self) -> list[tuple[int, int]]:
        return [
            (frame.address.x, frame.address.y)
            for frame in self.sent()
            if frame.data == to_module("TRACKING_REQ")
        ]


@pytest.fixture
def table() -> Table:
    return Table()


def to_all(*frames: bytes) -> list[ToModules]:
    return [ToModules(ALL_MODULES, frame) for frame in frames]


def test_it_does_nothing_by_itself(table: Table) -> None:
    table.step(100)
    assert (table.frames, table.said) == ([], [])


@pytest.mark.parametrize(
    ("command", "frames"),
    [
        (GridCommand.STOP_IR, [to_module("FORWARD_IR_MESSAGE_STOP")]),
        (GridCommand.SETUP, [to_module("MODULE_SETUP")]),
        (GridCommand.BOOTLOAD, [to_module("MODULE_BOOT")]),
        # Its second number is for old boot loaders.
        (GridCommand.IDLE, [to_module("MODULE_IDLE"), b"\xaa" + bytes(7)]),
        (GridCommand.PAUSE, [bytes(8)]),
        (0x12, [bytes(8)]),
    ],
)
def test_commands_go_to_all_modules(table: Table, command: int, frames: list[bytes]) -> None:
    table.command(command)
    table.step()
    assert table.sent() == to_all(*frames)


def test_stop_and_messages_for_robots_go_to_all_modules(table: Table) -> None:
    table.tell(Dispatched.STOP)
    table.tell(Dispatched.KILO_FORWARD_IR_MSG, *range(1, 10), 0x88)
    table.step()
    first, second = infrared(bytes(range(1, 10)), 0x88)
    stop = to_module("FORWARD_IR_MESSAGE_STOP")
    assert table.sent() == to_all(stop, first.data, second.data)


def test_types_that_it_does_not_know_do_nothing(table: Table) -> None:
    table.tell(Dispatched.LEDTOGGLE)
    table.tell(Dispatched.MODULE_FORWARD_CAN_MSG, 1, 2, 3)
    table.device.take(b"junk")
    table.step(10)
    assert (table.frames, table.said) == ([], [])


@pytest.mark.parametrize(
    "address", [module(3, 5), Address(3, 0, AddressType.COLUMN), Address(0, 5, AddressType.ROW)]
)
def test_a_configuration_goes_to_its_address(table: Table, address: Address) -> None:
    content = bytes(range(1, 15))
    table.tell(Dispatched.MODULE_CONFIGURATION, *address, len(content), *content)
    table.step(4)
    assert table.sent() == [ToModules(address, f.data) for f in configuration(content)]
    for wrong in ([*address[:2], 9, 4], [*address, 0], [*address, 49]):
        table.tell(Dispatched.MODULE_CONFIGURATION, *wrong)
    table.step(4)
    assert table.sent() == []


def test_pages_for_robots_are_asked_for_round_and_round(table: Table) -> None:
    table.tell(Dispatched.KILO_BOOTLOAD_START, 2)
    table.step(2)
    assert table.sent() == to_all(to_module("KILO_BOOTPAGE_SIZE", SizePart=0, Pages=2))
    page = bytes(range(128))
    asked = [0]
    for number in (0, 1, 0):
        assert table.said.pop()[1] == Notice(Dispatched.KILO_BOOTLOAD_GET_PAGE, asked[-1])
        began_s = table.now_s
        table.device.take(encode_page(Dispatched.KILO_BOOTPAGE, number, page))
        while not table.said:
            table.step()
        assert 0.130 < table.said[0][0] + STEP_S - began_s < 0.2
        assert table.sent() == to_all(*(f.data for f in robots_page(number, page)))
        asked.append((asked[-1] + 1) % 2)


def test_pages_for_modules_are_asked_for_once(table: Table) -> None:
    table.tell(Dispatched.MODULE_BOOTLOAD_START, 2)
    page = bytes(range(128))
    table.step()
    assert table.sent() == to_all(to_module("OLD_MODULE_BOOTPAGE_SIZE", SizePart=0, Pages=2))
    for number in (0, 1):
        assert table.said.pop()[1] == Notice(Dispatched.MODULE_BOOTLOAD_GET_PAGE, number)
        # The number that the packet gives does not matter.
        table.device.take(encode_page(Dispatched.MODULE_BOOTPAGE, 77, page))
        table.step(3)
        wanted = [f.data for f in modules_page(number, page, old_loader=True)]
        assert table.sent() == to_all(*wanted)
    assert table.said == []


def test_modules_are_polled_one_after_the_other_row_by_row(table: Table) -> None:
    table.command(GridCommand.RUN, 3, 2, 10)
    table.step(20)
    frames = table.frames
    assert frames[0][1].data == to_module("MODULE_RUN")
    sweep = [(x, y) for y in range(2) for x in range(3)]
    assert table.polled()[:18] == sweep * 3
    # In a step as many as it has time for.
    steps = [int(at_s / STEP_S + 1e-9) for at_s, _ in frames[1:]]
    assert max(steps.count(at_s) for at_s in steps) == 9


def test_after_five_sweeps_it_waits_for_the_pc(table: Table) -> None:
    table.command(GridCommand.RUN, 2, 2, 10)
    table.step(50)
    # It counts begins of sweeps, so that its first five are four and a module.
    assert len(table.polled()) == 4 * 4 + 1
    assert [packet for _, packet in table.said] == [AVAILABLE]
    table.step(100)
    assert table.polled() == []
    table.device.take(CONTINUE)
    table.step(50)
    assert len(table.polled()) == 5 * 4
    # Orders let it go on, too; a configuration does not.
    table.tell(Dispatched.MODULE_CONFIGURATION, 0, 0, 0, 1, 7)
    table.step(50)
    assert table.polled() == []
    table.tell(Dispatched.KILO_FORWARD_IR_MSG, *bytes(9), 0x85)
    table.step(50)
    assert len(table.polled()) == 5 * 4


def test_a_single_module_is_a_grid(table: Table) -> None:
    table.command(GridCommand.RUN, 1, 1, 1)
    table.step(50)
    assert table.polled() == [(0, 0)] * 5
    assert [packet for _, packet in table.said] == [AVAILABLE]


def report(robot: int, cell: int = 2) -> bytes:
    return bytes([0x11 | cell << 6, robot, 0, 1, 2, 3, 4, 5])


def test_reports_are_passed_on_when_there_are_enough(table: Table) -> None:
    table.command(GridCommand.RUN, 2, 1, 3)
    table.step()
    table.device.take(CONTINUE)
    table.reports = {(0, 0): [report(1), report(2)]}
    table.step(3)
    assert table.passed_on() == []
    table.device.take(CONTINUE)
    table.reports = {(1, 0): [report(3), report(4)]}
    table.step(3)
    (packet,) = table.passed_on()
    assert [(r.x, r.y, r.cell, r.data[0]) for r in packet.records] == [
        (0, 0, 2, 1),
        (0, 0, 2, 2),
        (1, 0, 2, 3),
        (1, 0, 2, 4),
    ]
    assert 2 <= packet.records[0].ticks <= packet.records[3].ticks <= 8


def test_the_last_reports_come_with_idle(table: Table) -> None:
    table.command(GridCommand.RUN, 1, 1, 30)
    table.reports = {(0, 0): [report(9)]}
    table.step(4)
    table.command(GridCommand.IDLE)
    table.step()
    packets = table.passed_on()
    assert [r.data[0] for r in packets[0].records] == [9]
    assert not table.device.running
    table.sent()
    table.command(GridCommand.IDLE)
    table.step(5)
    assert table.polled() == []
    assert len(table.passed_on()) == 1


def test_more_reports_than_its_buffer_holds_are_lost(table: Table) -> None:
    table.command(GridCommand.RUN, 1, 1, 255)
    table.step()
    for _ in range(5):
        table.reports = {(0, 0): [report(n) for n in range(10)]}
        while table.reports:
            table.device.take(CONTINUE)
            table.step()
    assert table.device.lost == 10


def test_a_dead_module_holds_up_sweep_and_orders_until_run(table: Table) -> None:
    table.dead = {(1, 1)}
    table.command(GridCommand.RUN, 2, 2, 10)
    table.step(50)
    # Those of the same step were still polled.
    polled = table.polled()
    assert polled[:4] == [(0, 0), (1, 0), (0, 1), (1, 1)]
    assert len(polled) < 9
    table.command(GridCommand.IDLE)
    table.command(GridCommand.STOP_IR)
    table.step(50)
    assert table.sent() == []
    table.command(GridCommand.RUN, 2, 2, 10)
    table.step(2)
    kinds = [frame.data[0] for frame in table.sent()]
    assert kinds[:5] == [0x0B, 0xAA, 0x02, 0x0D, 0x15]


def test_frames_that_are_no_answers_are_passed_over(table: Table) -> None:
    table.command(GridCommand.RUN, 1, 1, 1)
    table.step()
    table.device.hear((0, 0), b"\x14", 0.1)  # too short
    table.device.hear((0, 0), bytes(8), 0.1)  # a program's own
    table.device.hear((0, 0), report(5), 0.1)  # never announced
    table.step(4)
    assert [r.data[0] for r in table.passed_on()[0].records] == [5]
