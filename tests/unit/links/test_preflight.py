"""A grid is asked how it is, over buses that the test holds in its hand."""

import itertools

import can
import pytest

from kilotwin.errors import DeviceError
from kilotwin.experiment.spec.grid_layout import Layout
from kilotwin.experiment.spec.grid_plan import GridPlan, Settings
from kilotwin.table.grid.can_links import CanLinks
from kilotwin.table.links.preflight import look_at_table
from kilotwin.table.links.readiness import NotAsked
from kilotwin.table.links.roll_call import RollCall

from ..grid.module_table import ModuleTable

LAYOUT = Layout(2, 2, 2)
PLAN = GridPlan(LAYOUT, Settings(), {}, (), (), {})
NAMES = ("can0", "can1")
_numbers = itertools.count()


class Rig:
    """A table on virtual buses, and the clock by which it lives."""

    def __init__(self, *, ours: bool = True) -> None:
        channels = [f"preflight{next(_numbers)}" for _ in range(LAYOUT.buses)]
        host, table = (
            [can.Bus(interface="virtual", channel=channel) for channel in channels]
            for _ in range(2)
        )
        self.host = host
        self.links = CanLinks(host)
        modules = [LAYOUT.modules_of(bus) for bus in range(LAYOUT.buses)]
        self.table = ModuleTable(table, modules, ours=ours)
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s

    def sleep(self, seconds: float) -> None:
        self.time_s += seconds
        self.table.step(self.time_s)


def few(roll_call: RollCall) -> None:
    roll_call.ask()


def test_modules_tell_their_state_and_nothing_of_them_changes() -> None:
    rig = Rig()
    rig.table.modules[1, 0].state = "SETUP"
    seen = look_at_table(PLAN, rig.links, NAMES, rig, None)
    assert (seen.silent, seen.down, seen.robots) == ([], {}, NotAsked.UNWANTED)
    assert {module: answer.state.name for module, answer in seen.health.items()} == {
        **dict.fromkeys(LAYOUT.modules(), "IDLE"),
        (1, 0): "SETUP",
    }
    assert {answer.version for answer in seen.bus_health.values()} == {1}
    assert rig.table.states() == {"IDLE", "SETUP"}


def test_a_dead_module_is_silent_and_one_that_has_just_been_switched_on_is_not() -> None:
    rig = Rig()
    rig.table.modules[1, 0].dead = True
    rig.table.reset((0, 1), 0.0)
    seen = look_at_table(PLAN, rig.links, NAMES, rig, None)
    assert seen.silent == [(1, 0)]
    assert (0, 1) in seen.health


def test_robots_are_asked_where_modules_ask_them() -> None:
    assert look_at_table(PLAN, (rig := Rig()).links, NAMES, rig, few).robots == {}
    original = Rig(ours=False)
    seen = look_at_table(PLAN, original.links, NAMES, original, few)
    assert (seen.silent, seen.health) == ([], {})
    assert seen.robots is NotAsked.NO_MODULE
    running = Rig()
    for module in running.table.modules.values():
        module.state = "RUNNING"
    seen = look_at_table(PLAN, running.links, NAMES, running, few)
    assert seen.robots is NotAsked.RUNNING
    assert running.table.states() == {"RUNNING"}


def test_modules_on_a_bus_that_is_down_are_silent_and_without_any_bus_there_is_no_table(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def gone(*_: object) -> None:
        raise can.CanOperationError("gone")

    rig = Rig()
    monkeypatch.setattr(rig.host[1], "send", gone)
    seen = look_at_table(PLAN, rig.links, NAMES, rig, few)
    assert (seen.down, seen.silent) == ({1: "gone"}, [(0, 1), (1, 1)])
    assert seen.robots is NotAsked.BUS_DOWN
    monkeypatch.setattr(rig.host[0], "send", gone)
    with pytest.raises(DeviceError, match="can0: gone; can1: gone"):
        look_at_table(PLAN, rig.links, NAMES, rig, few)
