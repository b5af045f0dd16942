"""The host sets up, runs, polls, pauses and idles a table of modules, whatever befalls some."""

import errno
import itertools
import math
from collections.abc import Callable, Iterator
from typing import Any

import can
import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.spec.grid_layout import Layout
from kilotwin.experiment.spec.grid_plan import Settings
from kilotwin.experiment.spec.overhead import RESET, RUN, WAKEUP, message
from kilotwin.table.can.protocol import ModuleState
from kilotwin.table.can.transfer import Paced
from kilotwin.table.flash.modules_table import Inbox
from kilotwin.table.grid.can_links import CanLinks
from kilotwin.table.grid.controller import Controller
from kilotwin.table.grid.cover import ALL_MODULES, Group
from kilotwin.table.grid.poller import Reports
from kilotwin.table.grid.silence import SILENT_S

from .module_table import Module, ModuleTable

STEP_S = 0.001
CONFIG = message([1, 0, 9, 0, 4, 1, 2, 3, 4], 3)
QUICK = Settings(hold_s=0.1, rounds=2)

_names = itertools.count()


class Rig:
    """A controller and a table on virtual buses, and the time."""

    def __init__(self, layout: Layout, settings: Settings, *, ours: bool, step_s: float) -> None:
        name = f"table{next(_names)}"
        self.layout = layout
        self.buses = [
            [can.Bus(interface="virtual", channel=f"{name}-{bus}") for bus in range(layout.buses)]
            for _ in range(2)
        ]
        self.table = ModuleTable(
            self.buses[1], [layout.modules_of(bus) for bus in range(layout.buses)], ours=ours
        )
        self.step_s = step_s
        self.now_s = 0.0
        self.events: list[tuple[float, str, dict[str, Any]]] = []
        self.heard: list[tuple[int, int, int, bytes]] = []
        self.controller = Controller(layout, settings, CanLinks(self.buses[0]), self)

    def reports(self, reports: Reports) -> None:
        self.heard += zip(
            reports.x.tolist(),
            reports.y.tolist(),
            reports.cell.tolist(),
            map(bytes, reports.data),
            strict=True,
        )

    def event(self, now_s: float, kind: str, text: str, **more: Any) -> None:
        self.events.append((now_s, kind, more))

    def kinds(self) -> list[str]:
        return [kind for _, kind, _ in self.events]

    def pass_time(self, seconds: float, until: Callable[[], bool] | None = None) -> None:
        """Steps both every `step_s`, but for the stretches in which nothing is due."""
        end_s = self.now_s + seconds
        while self.now_s < end_s and not (until and until()):
            self.controller.step(self.now_s)
            self.table.step(self.now_s)
            self.now_s += self.step_s
            if not (until and until()):
                due_s = min(self.controller.next_step_s(), self.table.next_step_s(), end_s)
                self.now_s += self.step_s * max(0, math.floor((due_s - self.now_s) / self.step_s))

    def until_done(self, within_s: float = 60.0) -> None:
        self.pass_time(within_s, lambda: not self.controller.busy)
        assert not self.controller.busy

    def start(self, configuration: dict[Module, bytes] | None = None) -> None:
        """Set up and running."""
        everything = dict.fromkeys(self.layout.modules(), b"\2\2\2\2")
        self.controller.step(self.now_s)
        self.controller.set_up({**everything, **(configuration or {})}, [CONFIG])
        self.until_done()
        self.controller.run()
        self.until_done()

    def close(self) -> None:
        for bus in (*self.buses[0], *self.buses[1]):
            bus.shutdown()


Build = Callable[..., Rig]


@pytest.fixture
def build() -> Iterator[Build]:
    rigs: list[Rig] = []

    def build(
        columns: int = 3,
        rows: int = 4,
        buses: int = 2,
        ours: bool = True,
        step_s: float = STEP_S,
        **settings: Any,
    ) -> Rig:
        kept = Settings(**{**QUICK.__dict__, **settings})
        rigs.append(Rig(Layout(columns, rows, buses), kept, ours=ours, step_s=step_s))
        return rigs[-1]

    yield build
    for rig in rigs:
        rig.close()


def test_a_grid_is_set_up_and_runs(build: Build) -> None:
    rig = build()
    rig.start({(1, 1): b"\3\3\3\3", (2, 3): bytes(range(48))})
    modules = rig.table.modules
    assert rig.table.states() == {"RUNNING"}
    assert modules[0, 0].configuration == b"\2\2\2\2"
    assert modules[1, 1].configuration == b"\3\3\3\3"
    assert modules[2, 3].configuration == bytes(range(48))
    assert all(module.set_up and module.runs == 1 for module in modules.values())
    assert all(module.forwarded == [RESET, CONFIG, CONFIG] for module in modules.values())
    assert {kind for kind in rig.kinds() if kind.startswith("module")} == set()


def test_frames_for_one_module_keep_their_distance(build: Build) -> None:
    rig = build(pace_s=0.002)
    rig.start({(1, 1): bytes(range(48))})
    rig.pass_time(3)
    assert min(module.least_gap_s for module in rig.table.modules.values()) > 0.0019


def test_two_hundred_modules_take_few_frames(build: Build) -> None:
    rig = build(columns=10, rows=20, buses=4)
    ring = {
        (x, y): bytes([1 + (x == 0), 1 + (x == 9), 1 + (y == 0), 1 + (y == 19)])
        for x in range(10)
        for y in range(20)
    }
    rig.controller.step(0)
    rig.controller.set_up(ring, [])
    rig.until_done()
    assert {place: module.configuration for place, module in rig.table.modules.items()} == ring
    # Two frames to a bus for its background and each of its sides, and its corners.
    sides, corners = 2 * 4 + 2, 4
    configured = next(more for _, kind, more in rig.events if kind == "configure")
    assert configured["frames"] == 2 * (4 + sides + corners)


def test_reports_arrive_once_and_in_order(build: Build) -> None:
    rig = build()
    rig.start()
    said = []
    for number in range(40):
        module, cell = (number % 3, number % 4), number % 4
        rig.table.robot_says(module, cell, bytes([number, 1, 2, 3, 4, 5, 6]))
        said.append((*module, cell, bytes([number, 1, 2, 3, 4, 5, 6])))
        rig.pass_time(0.2)
    rig.pass_time(2)
    assert sorted(rig.heard) == sorted(said)
    for module in {heard[:2] for heard in rig.heard}:
        numbers = [heard[3][0] for heard in rig.heard if heard[:2] == module]
        assert numbers == sorted(numbers)


def test_every_module_is_asked_once_per_period(build: Build) -> None:
    rig = build(poll_s=0.5)
    rig.start()
    rig.pass_time(1)
    before = {place: module.asked for place, module in rig.table.modules.items()}
    rig.pass_time(10)
    for place, module in rig.table.modules.items():
        assert 19 <= module.asked - before[place] <= 21


def test_no_more_modules_owe_an_answer_than_the_window_says(build: Build) -> None:
    rig = build(columns=5, rows=4, buses=1, poll_window=3)
    rig.start()
    for module in rig.table.modules.values():
        module.dead = True
    rig.table.frames = 0
    rig.pass_time(0.7)  # the first sweep begins after 0.6 s, an answer is given up after 0.2 s
    assert rig.table.frames == 3


def test_a_dead_module_is_passed_over_and_reported(build: Build) -> None:
    rig = build()
    rig.start()
    rig.table.modules[1, 2].dead = True
    died_s = rig.now_s
    rig.pass_time(10)
    (found,) = [event for event in rig.events if event[1] == "module_silent"]
    assert found[2] == {"module": [1, 2]}
    assert found[0] - died_s < SILENT_S + 0.8
    rig.table.robot_says((2, 2), 0, bytes(7))
    rig.pass_time(1.5)
    assert rig.heard == [(2, 2, 0, bytes(7))]
    assert rig.controller.poller.silent == [(1, 2)]


def test_a_module_dead_from_the_begin_does_not_stop_the_rest(build: Build) -> None:
    rig = build()
    rig.table.modules[0, 0].dead = True
    rig.start()
    assert rig.table.states() == {"RUNNING"}
    assert [more for _, kind, more in rig.events if kind == "module_silent"] == [{"module": [0, 0]}]


@pytest.mark.parametrize("ours", [True, False])
@pytest.mark.parametrize("phase", [0.0, 0.2, 0.4, 0.6, 0.8, 0.99])
def test_a_module_that_was_reset_is_configured_again(
    build: Build, ours: bool, phase: float
) -> None:
    """Whenever between two polls the power fails, and whether or not the module is ours."""
    rig = build(ours=ours, health=ours)
    rig.start({(1, 1): b"\7\6\5\4"})
    rig.pass_time(2 + phase)
    rig.table.reset((1, 1), rig.now_s)
    # 1.2 s silent, polled within 0.8 s; an original one is watched for four more polls.
    rig.pass_time(4 if ours else 6.5)
    module = rig.table.modules[1, 1]
    assert module.state == "RUNNING"
    assert module.configuration == b"\7\6\5\4"
    assert rig.kinds().count("module_configured_again") == 1
    others = [m for place, m in rig.table.modules.items() if place != (1, 1)]
    assert all(other.runs == 1 for other in others)


@pytest.mark.parametrize("ours", [True, False])
@pytest.mark.parametrize("pause_s", [0.5, 0.7, 1.0, 1.7, 3.0])
def test_modules_whose_programs_pause_are_not_configured_again(
    build: Build, ours: bool, pause_s: float
) -> None:
    # The host waits for an answer nearly all the time, so that nothing can be skipped.
    rig = build(ours=ours, health=ours, step_s=0.005)
    for module in rig.table.modules.values():
        module.pause_s = pause_s
    rig.start()
    rig.pass_time(60)
    assert rig.controller.poller.counts.missed > 60
    assert rig.kinds().count("module_configured_again") == 0
    assert rig.kinds().count("module_pauses") <= 1
    assert not {"module_silent", "module_back"} & set(rig.kinds())
    assert rig.controller.silent == []
    assert all(module.runs == 1 for module in rig.table.modules.values())


@pytest.mark.parametrize("pause_s", [3.0, 9.0])
def test_a_module_that_dies_among_those_that_pause_is_reported(
    build: Build, pause_s: float
) -> None:
    rig = build(ours=False)
    for module in rig.table.modules.values():
        module.pause_s = pause_s
    rig.start()
    rig.pass_time(5 * pause_s)
    # Until a second answer in a row is late, a long pause looks like a module that is gone.
    early = rig.kinds().count("module_silent")
    assert early == rig.kinds().count("module_back") <= (0 if pause_s < SILENT_S else 2 * 12)
    assert rig.kinds().count("module_pauses") == 1
    rig.table.modules[1, 2].dead = True
    rig.pass_time(5 * pause_s)
    assert rig.kinds().count("module_silent") == early + 1
    assert rig.controller.silent == [(1, 2)]


def test_a_module_that_was_reset_among_those_that_pause_is_configured_again(build: Build) -> None:
    rig = build(ours=False, poll_s=0.8)
    for module in rig.table.modules.values():
        module.pause_s = 0.7
    rig.start({(1, 1): b"\7\6\5\4"})
    rig.pass_time(10)
    rig.table.reset((1, 1), rig.now_s)
    rig.pass_time(2 + 33 * 0.8)
    again = [more["module"] for _, kind, more in rig.events if kind == "module_configured_again"]
    assert again == [[1, 1]]
    assert rig.table.modules[1, 1].state == "RUNNING"
    assert rig.table.modules[1, 1].configuration == b"\7\6\5\4"


def test_configurations_of_one_module_are_sent_in_turn(build: Build) -> None:
    rig = build()
    line = (b"\1\1\1\1",)
    wanted: dict[Module, tuple[bytes, ...]] = {(x, y): line for x in range(3) for y in range(4)}
    wanted[1, 1] = (*line, bytes(range(9)), b"\3\3\3\3")
    wanted[2, 1] = (*line, b"\4")
    del wanted[0, 3]
    rig.controller.step(0)
    rig.controller.set_up(wanted, [])
    rig.until_done()
    sent = {place: tuple(module.configurations) for place, module in rig.table.modules.items()}
    assert sent == {**wanted, (0, 3): ()}
    assert {module.state for module in rig.table.modules.values()} == {"SETUP"}
    rig.controller.run()
    rig.until_done()
    rig.controller.change({(1, 1): (b"\5",), (0, 0): (b"\6", b"\7")})
    rig.until_done()
    assert rig.table.modules[1, 1].configurations[3:] == [b"\5"]
    assert rig.table.modules[0, 0].configurations[1:] == [b"\6", b"\7"]
    rig.pass_time(2)
    rig.table.reset((1, 1), rig.now_s)
    rig.table.modules[1, 1].configurations.clear()
    rig.pass_time(8)
    assert rig.table.modules[1, 1].configurations == [*wanted[1, 1], b"\5"]
    assert rig.table.states() == {"RUNNING"}


def test_a_module_of_ours_that_was_only_late_is_left_alone(build: Build) -> None:
    rig = build(health=True)
    rig.start()
    rig.pass_time(2)
    rig.table.modules[1, 1].deaf_until_s = rig.now_s + 1.5
    rig.pass_time(4)
    assert rig.controller.poller.counts.missed > 0
    assert "module_configured_again" not in rig.kinds()
    assert rig.table.modules[1, 1].runs == 1


def test_health_is_asked_only_when_told_to(build: Build) -> None:
    rig = build(health=False)
    rig.start()
    rig.pass_time(3)
    assert rig.controller.health == {}
    rig.controller.request_health([(0, 0), (2, 3)])
    rig.until_done()
    assert set(rig.controller.health) == {(0, 0), (2, 3)}
    health = rig.controller.health[0, 0]
    assert (health.state, health.config_size) == (ModuleState.RUNNING, 4)
    assert rig.controller.bus_health[0, 0].uptime_s == 42


def test_a_configuration_that_did_not_arrive_is_sent_again(build: Build) -> None:
    rig = build(health=True)
    module = rig.table.modules[2, 1]
    # The first transfer to one module is lost.
    configure = rig.table._chunk
    rig.table._chunk = lambda fake, data: (  # type: ignore[method-assign]
        configure(fake, data) if fake is not module or len(module.forwarded) > 3 else None
    )
    rig.controller.step(0)
    rig.controller.set_up(dict.fromkeys(rig.layout.modules(), b"\1\2\3\4"), [CONFIG])
    rig.pass_time(60, lambda: any("configure" in kind for kind in rig.kinds()))
    rig.pass_time(0.2)
    rig.table._chunk = configure  # type: ignore[method-assign]
    rig.until_done()
    assert module.configuration == b"\1\2\3\4"


def test_frames_are_transmitted_as_they_are_and_at_their_own_pace(build: Build) -> None:
    rig = build()
    began_s = rig.now_s
    idle = [(Group(1, 0), Paced(b"\x0c", 0.02)), (Group(1, 0), Paced(b"\x0d", 0.0))]
    rig.controller.transmit({0: idle, 1: [(ALL_MODULES, Paced(b"\x0c", 0.0))]}, 0.1)
    assert rig.controller.queued == 0
    rig.controller.step(rig.now_s)
    assert rig.controller.queued == 1
    rig.until_done()
    assert 0.12 <= rig.now_s - began_s < 0.13
    states = {place: module.state for place, module in rig.table.modules.items()}
    assert states[1, 0] == "RUNNING"
    assert {states[x, y] for x in range(3) for y in (2, 3)} == {"SETUP"}
    assert states[0, 0] == "IDLE"
    assert rig.table.modules[1, 0].least_gap_s >= 0.02


def test_pause_and_resume_reach_the_robots(build: Build) -> None:
    rig = build()
    rig.start()
    rig.controller.pause()
    rig.until_done()
    assert rig.table.states() == {"IDLE"}
    assert rig.table.modules[0, 0].forwarded[-1] == WAKEUP
    asked = rig.table.modules[0, 0].asked
    rig.pass_time(3)
    assert rig.table.modules[0, 0].asked == asked
    rig.controller.resume()
    rig.until_done()
    assert rig.table.states() == {"RUNNING"}
    assert rig.table.modules[0, 0].forwarded[-1] == RUN
    rig.pass_time(3)
    assert rig.table.modules[0, 0].asked > asked
    assert "module_back" not in rig.kinds()


def test_a_change_reaches_those_it_is_for_and_they_run_on(build: Build) -> None:
    rig = build()
    rig.start()
    rig.pass_time(1.3)
    rig.controller.change({(0, 0): b"\4\4\4\4", (2, 3): b"\5\5\5\5"})
    rig.until_done()
    rig.pass_time(3)
    modules = rig.table.modules
    assert modules[0, 0].configuration == b"\4\4\4\4"
    assert modules[2, 3].configuration == b"\5\5\5\5"
    assert modules[1, 1].configuration == b"\2\2\2\2"
    assert rig.table.states() == {"RUNNING"}
    assert {place for place, module in modules.items() if module.runs == 2} == {(0, 0), (2, 3)}
    assert not [kind for kind in rig.kinds() if kind.startswith("module")]


@pytest.mark.parametrize(
    ("configuration", "said"),
    [
        ({(9, 0): b"\1"}, r"there is no module \(9, 0\) on a grid of "),
        ({0: b"\1"}, "there is no module 0 on a grid of "),
        ({(0, 0): b""}, r"module \(0, 0\) is to be b''; a configuration is bytes, 1 to 48 of them"),
        ({(0, 0): bytes(49)}, "a configuration is bytes, 1 to 48 of them"),
        ({(0, 0): ()}, "a configuration is bytes, 1 to 48 of them"),
        ({(0, 0): (b"\1", b"")}, "a configuration is bytes, 1 to 48 of them"),
        ({(0, 0): "red"}, r"module \(0, 0\) is to be 'red'; a configuration is bytes"),
        ([(0, 0)], "is no configuration; write"),
    ],
)
def test_an_order_that_cannot_be_carried_out_is_refused(
    build: Build, configuration: Any, said: str
) -> None:
    controller = build().controller
    for order in (controller.change, controller.configure):
        with pytest.raises(InputError, match=said):
            order(configuration)
    assert not controller.busy


def test_idle_fetches_what_is_left_and_stops_robots_and_modules(build: Build) -> None:
    rig = build()
    rig.start()
    rig.pass_time(2.2)
    rig.table.robot_says((1, 3), 2, b"goodbye")
    rig.controller.set_idle()
    rig.until_done()
    assert rig.heard == [(1, 3, 2, b"goodbye")]
    assert rig.table.states() == {"IDLE"}
    assert all(module.repeating is None for module in rig.table.modules.values())
    assert rig.table.modules[0, 0].forwarded[-1] == WAKEUP


def test_idle_in_the_middle_of_a_set_up_stops_it(build: Build) -> None:
    rig = build(hold_s=2.0)
    rig.controller.step(0)
    rig.controller.set_up(dict.fromkeys(rig.layout.modules(), b"\1\1\1\1"), [CONFIG] * 5)
    rig.pass_time(3)
    rig.controller.set_idle()
    rig.until_done(5.0)
    assert rig.table.states() == {"IDLE"}
    assert rig.table.modules[0, 0].forwarded[-1] == WAKEUP


def test_a_host_that_was_away_blames_nobody(build: Build) -> None:
    rig = build()
    rig.start()
    rig.pass_time(2.0)
    end_s = rig.now_s + 30
    while rig.now_s < end_s:  # the table lives on alone
        rig.table.step(rig.now_s)
        rig.now_s += STEP_S
    rig.table.robot_says((0, 0), 0, bytes(7))
    rig.pass_time(3)
    assert not [kind for kind in rig.kinds() if kind.startswith("module")]
    assert rig.heard == [(0, 0, 0, bytes(7))]


def test_frames_that_no_one_should_send_are_counted_and_nothing_else(build: Build) -> None:
    rig = build()
    rig.start()
    rig.pass_time(2)
    bad = [
        (0x083, b"\x14"),  # START without its number
        (0x083, b"\x14\x0b"),  # more reports than there is room for
        (0x083, b"\x11\1\2\3"),  # half a report
        (0x7FF, b"\x14\0"),  # a module beside the grid
        (0x001, b"\x11\1\2\3\4\5\6\7"),  # no module
        (0x083, b""),
    ]
    before = rig.controller.poller.counts.bad_frames
    for identifier, data in bad:
        rig.buses[1][0].send(
            can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        )
    rig.buses[1][0].send(can.Message(arbitration_id=0x083, is_remote_frame=True, dlc=2))
    rig.buses[1][0].send(can.Message(arbitration_id=0x12345, data=b"\x14\1", is_extended_id=True))
    rig.pass_time(2)
    assert rig.controller.poller.counts.bad_frames - before == 5
    assert rig.heard == []
    assert not [kind for kind in rig.kinds() if kind.startswith("module")]


def pull_the_plug(bus: can.BusABC, error: can.CanOperationError) -> None:
    """From now on it takes nothing."""

    def refuse(msg: can.Message, timeout: float | None = None) -> None:
        raise error

    bus.send = refuse  # type: ignore[method-assign]


def test_without_one_bus_the_others_are_polled_changed_and_stopped(build: Build) -> None:
    rig = build(poll_s=0.8)
    rig.start()
    pull_the_plug(rig.buses[0][1], can.CanOperationError("gone"))
    rig.pass_time(1.0)
    assert rig.controller.down == {1: "gone"}
    asked = rig.table.modules[0, 0].asked
    rig.pass_time(8.0)
    assert rig.table.modules[0, 0].asked - asked == pytest.approx(8.0 / 0.8, abs=2)
    rig.controller.change({(0, 0): b"\5\5\5\5", (0, 3): b"\5\5\5\5"})
    rig.until_done()
    assert rig.table.modules[0, 0].configuration == b"\5\5\5\5"
    rig.controller.set_idle()
    rig.until_done(within_s=10.0)
    lower = [module for place, module in rig.table.modules.items() if place[1] < 2]
    assert {module.state for module in lower} == {"IDLE"}
    assert all(module.forwarded[-1] == WAKEUP for module in lower)
    assert rig.controller.unsent == [1]
    assert "idle" not in rig.kinds()


def test_why_a_bus_is_down_is_said_in_one_line(build: Build) -> None:
    rig = build()
    error = can.CanOperationError("Failed to transmit: OSError\nTraceback ...")
    error.__cause__ = OSError(errno.ENETDOWN, "Network is down")
    pull_the_plug(rig.buses[0][0], error)
    rig.controller.set_idle()
    rig.pass_time(0.1)
    assert rig.controller.down == {0: "network is down"}


def test_a_bus_on_which_nobody_acknowledges_is_down_when_its_queue_stays_full(
    build: Build,
) -> None:
    rig = build()
    rig.start()
    pull_the_plug(rig.buses[0][0], can.CanOperationError("full", errno.ENOBUFS))
    rig.pass_time(0.5)
    assert not rig.controller.down
    rig.pass_time(3.0)
    assert list(rig.controller.down) == [0]
    del rig.buses[0][0].send
    rig.pass_time(2.0)
    assert not rig.controller.down
    assert rig.kinds()[-1] != "bus_down"
    rig.controller.set_idle()
    rig.until_done()
    assert rig.table.states() == {"IDLE"}
    assert rig.kinds()[-1] == "idle"


class LocalBus(can.BusABC):
    """As the kernel's vcan: frames of any program on this machine come back as if sent by us."""

    def __init__(self, frames: list[can.Message]) -> None:
        super().__init__(channel="local")
        self.frames = frames

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        msg.is_rx = False
        self.frames.append(msg)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        return (self.frames.pop(0), False) if self.frames else (None, False)


def test_an_emulated_table_on_the_same_machine_is_heard_and_our_own_frames_are_ours() -> None:
    answer = can.Message(arbitration_id=0x043, data=[0x14, 0], is_extended_id=False, is_rx=False)
    links = CanLinks([LocalBus([answer])], echoes=[True])
    assert links.send(0, 0x042, b"\x15", 0.0)
    frames = links.receive(1.0)
    links.close()
    told = [(int(frame["id"]), bool(frame["from_host"])) for frame in frames]
    assert told == [(0x043, False), (0x042, True)]


def test_another_host_on_the_same_machine_is_not_taken_for_us() -> None:
    """Also where it sends the very frame that we do."""

    def foreign(page: int) -> can.Message:
        return can.Message(arbitration_id=0, data=[9, 0, page], is_extended_id=False, is_rx=False)

    inbox = Inbox()
    links = CanLinks([LocalBus([foreign(1), foreign(2)])], inbox, echoes=[True])
    for data in (b"\x09\x00\x02", b"\x09\x00\x03"):
        assert links.send(0, 0, data, 0.0)
    told = [(int(frame["data"][2]), bool(frame["from_host"])) for frame in links.receive(1.0)]
    assert told == [(1, False), (2, True), (2, False), (3, True)]
    assert inbox.stranger
    assert links.send(0, 0, b"\x09\x00\x02", 1.0)
    assert links.receive(2.0)["from_host"].all()
    links.close()
