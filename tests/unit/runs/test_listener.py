"""What robots' programs get in a run's first seconds is reported once, for their twins."""

from types import SimpleNamespace
from typing import Any, cast

from kilotwin.session.recorder import Listener
from kilotwin.units import ticks


class OneEar:
    """A robot that got a message in a grid's lead, and two from RUN on."""

    listens: list[list[int]]

    def __init__(self) -> None:
        self.listens = []

    def listen_to(self, robots: list[int]) -> None:
        self.listens.append(list(robots))

    def heard_by(self, robot: int) -> list[tuple[int, bytes, int]]:
        return [(-1953, b"\x83", 40), (0, b"\x01", 41), (7, b"\x02", robot)]


def test_messages_from_run_on_are_reported_once_and_those_of_a_grids_lead_are_not() -> None:
    reports: list[Any] = []
    ear = OneEar()
    listener = Listener(cast(Any, SimpleNamespace(simulation=ear)), [42], 10.0, reports.append)
    assert ear.listens == [[42]]
    assert listener.next_due() == ticks(10.0)
    listener.step(ticks(10.0) - 1)
    assert not reports
    listener.step(ticks(10.0))
    listener.finish()
    assert reports == [{"type": "heard", "heard": {42: [(0, "01", 41), (7, "02", 42)]}}]
    assert ear.listens == [[42], []]
    assert listener.next_due() > ticks(1e6)
