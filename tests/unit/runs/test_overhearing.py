"""A listener on a Kilogrid's buses hears reports and silent modules, and never sends a frame."""

from collections.abc import Callable, Iterator
from pathlib import Path

import can
import numpy as np
import pytest

from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.reader import Run
from kilotwin.session import overhearing
from kilotwin.session.overhearing import Overhearing
from kilotwin.table.can.buses import BusName, OpenBus
from kilotwin.table.grid import frames as wire
from kilotwin.table.grid.cover import Group

from ..conftest import GRID, Load


class Bus:
    """Hands over what it was given; sending on it is found out."""

    def __init__(self) -> None:
        self.waiting: list[can.Message] = []
        self.closed = False

    def recv(self, _: float | None = None) -> can.Message | None:
        return self.waiting.pop(0) if self.waiting else None

    def send(self, *_: object) -> None:
        raise AssertionError("sent")

    def shutdown(self) -> None:
        self.closed = True

    def carry(self, identifier: int, data: bytes) -> None:
        self.waiting.append(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))


Hear = Callable[[], tuple[Overhearing, list[Bus]]]


@pytest.fixture
def hear(load: Load, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Hear]:
    """A listener of a grid of 4 x 6 modules, on two buses."""
    made: list[Overhearing] = []

    def hear() -> tuple[Overhearing, list[Bus]]:
        buses = [Bus(), Bus()]
        opened = [OpenBus(bus, f"can{k}", echoes=False) for k, bus in enumerate(buses)]  # type: ignore[arg-type]
        monkeypatch.setattr(overhearing, "open_all", lambda _: opened)
        experiment: Experiment = load(GRID)
        names = [BusName("socketcan", "can0"), BusName("socketcan", "can1")]
        made.append(Overhearing(experiment, names, tmp_path / "heard"))
        return made[0], buses

    yield hear
    for one in made:
        one.close()


def poll(bus: Bus, x: int, y: int) -> None:
    """The host asks a module."""
    bus.carry(wire.id_of_group(Group(x, y)), wire.fixed().TRACKING_REQUEST)


def report(bus: Bus, x: int, y: int, uid: int) -> None:
    """A module answers with one report, of its upper left cell."""
    fixed = wire.fixed()
    identifier = wire.id_from_module((x, y))
    start = bytes([fixed.START, 1]).ljust(fixed.START_BYTES, b"\0")
    bus.carry(identifier, start)
    bus.carry(identifier, bytes([fixed.TRACKING, uid, 0, 0, 0, 0, 0, 0]))


def test_robots_are_where_modules_report_them(hear: Hear, tmp_path: Path) -> None:
    listener, buses = hear()
    listener.step(0.5)
    report(buses[0], 1, 0, uid=3)
    report(buses[0], 1, 0, uid=200)
    listener.step(1.0)
    rows = Run.open(tmp_path / "heard").tracking().to_pylist()
    assert [(row["robot"], row["module_x"], row["module_y"]) for row in rows] == [
        (2, 1, 0),
        (199, 1, 0),
    ]
    robots = Run.open(tmp_path / "heard").robots()
    heard = ~np.isnan(np.asarray(robots["x_m"]).reshape(2, 5))
    assert heard.tolist() == [[False] * 5, [False, False, True, False, False]]
    assert listener.state()["strangers"] == 1


def test_a_module_that_leaves_polls_unanswered_is_silent_until_it_answers(hear: Hear) -> None:
    listener, buses = hear()
    for _ in range(3):
        poll(buses[0], 2, 0)
        poll(buses[1], 0, 5)
        report(buses[1], 0, 5, uid=1)
    listener.step(1.0)
    assert listener.state()["silent"] == [[2, 0]]
    report(buses[0], 2, 0, uid=1)
    listener.step(1.1)
    assert listener.state()["silent"] == []


def test_rates_and_load_are_those_of_the_last_seconds(hear: Hear) -> None:
    listener, buses = hear()
    for _ in range(50):
        report(buses[0], 0, 0, uid=1)
    listener.step(0.1)
    busy, quiet = listener.state()["buses"]
    assert busy["frames_s"] > 0
    assert busy["load"] > 0
    assert quiet == {"name": "can1", "frames_s": 0, "load": 0, "trouble": None}
    listener.step(30.0)
    assert listener.state()["buses"][0]["frames_s"] == 0


def test_it_never_sends(hear: Hear) -> None:
    listener, buses = hear()
    for time_s in range(20):
        poll(buses[0], 1, 1)
        listener.step(float(time_s))  # a Bus that is sent on raises
    with pytest.raises(AssertionError):
        listener._links.send(0, 1, b"", 0)


def test_a_bus_that_fails_is_named(hear: Hear, monkeypatch: pytest.MonkeyPatch) -> None:
    listener, buses = hear()

    def down(_: float | None = None) -> None:
        raise can.CanOperationError("network is down")

    monkeypatch.setattr(buses[1], "recv", down)
    listener.step(1.0)
    assert listener.state()["buses"][1]["trouble"] == "network is down"
