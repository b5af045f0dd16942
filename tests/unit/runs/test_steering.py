"""Orders of a viewer are checked and carried out, and each is an event."""

import json
import select
import socket
from typing import Any

import numpy as np
import pytest

from kilotwin import _emulator
from kilotwin.errors import InputError
from kilotwin.experiment.schema.record import EXTRA_OF
from kilotwin.runs.packing import head_of
from kilotwin.session.acts import PACED, STEERED, Repetition, acts_of
from kilotwin.session.live import Live, chunk_s
from kilotwin.session.live_link import LENGTH
from kilotwin.session.loop import NEVER
from kilotwin.session.steering import Steering

from ..known_run import samples

WAKEUP = [0] * 9 + [0x85]


class Table:
    """An engine that notes what it is told; robot 3 has no room anywhere."""

    robots = 10
    tick = 100

    def __init__(self) -> None:
        self.told: list[tuple[Any, ...]] = []

    def snapshot(self) -> Any:
        return samples([self.tick])

    def close_look(self) -> Any:
        return samples([self.tick], extras=True)

    def place(self, robot: int, *pose: float) -> None:
        if robot == 3:
            raise _emulator.EngineError("robot 3 has no room there")
        self.told.append(("place", robot, *pose))

    def modules(self) -> Any:
        counters = {"state": "running", "can": "active", "tec": 8, "rec": 1}
        return [{"x": 0, "y": 1, **counters, "frames_refused": 2, "frames_missed": 3, "tick": 5}]

    def turn(self, robot: int, heading: float) -> None:
        self.told.append(("turn", robot, heading))

    def send(self, *message: Any) -> None:
        self.told.append(("send", *message))


class Bench:
    """Steering of a Table, with the events of it."""

    def __init__(self) -> None:
        self.table = Table()
        self.events: list[dict[str, Any]] = []
        self.grid: list[str] = []
        self.steering = Steering(self.table, 30, self.events.append)  # type: ignore[arg-type]

    def do(self, **order: Any) -> None:
        self.steering.do({"id": 1, **order})


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_a_robot_that_is_placed_keeps_its_heading_and_is_in_the_events(bench: Bench) -> None:
    bench.do(do="place", robot=2, x_m=0.25, y_m=-1)
    heading = float(samples([100])["heading_rad"][0][2])
    assert bench.table.told == [("place", 2, 0.25, -1, heading)]
    (event,) = bench.events
    assert (event["tick"], event["kind"], event["robot"]) == (100, STEERED, 2)
    assert event["text"] == "robot 3 is put to 0.250, -1.000"


def test_a_robot_is_turned_where_it_stands(bench: Bench) -> None:
    bench.do(do="turn", robot=3, heading_rad=np.pi / 2)
    assert bench.table.told == [("turn", 3, np.pi / 2)]
    assert bench.events[0]["text"] == "robot 4 is turned to 90 degrees"


def test_what_was_done_is_done_again_at_its_tick(bench: Bench) -> None:
    message = {"data": WAKEUP, "uid_first": 4, "uid_last": 4, "region": [0.0, 1.0, 0.5]}
    bench.do(do="place", robot=2, x_m=0.25, y_m=-1, heading_rad=1)
    bench.do(do="pause")
    bench.table.tick = 104
    bench.do(do="turn", robot=2, heading_rad=2)
    bench.do(do="send", messages=[message], told="pause")
    again = Bench()
    recorded = json.loads(json.dumps(bench.events))
    repetition = Repetition(acts_of(recorded), again.steering.do)
    repetition.step(96)
    assert repetition.next_due() == 100
    assert again.table.told == []
    repetition.step(100)
    assert repetition.next_due() == 104
    assert len(again.table.told) == 1
    again.table.tick = 104
    repetition.step(104)
    assert repetition.next_due() == NEVER
    assert again.table.told == bench.table.told
    assert [event["text"] for event in again.events] == [
        event["text"] for event in bench.events if event["kind"] == STEERED
    ]


def test_a_message_goes_to_those_it_is_for(bench: Bench) -> None:
    message = {"data": WAKEUP, "uid_first": 4, "uid_last": 4, "region": [0.0, 1.0, 0.5]}
    bench.do(do="send", messages=[message], told="pause")
    assert bench.table.told == [("send", bytes(WAKEUP), 4, 4, (0.0, 1.0, 0.5))]
    assert bench.events[0]["text"] == "pause"


@pytest.mark.parametrize(
    ("order", "why"),
    [
        ({"do": "place", "robot": 3, "x_m": 0, "y_m": 0}, "robot 4 has no room there"),
        ({"do": "place", "robot": 10, "x_m": 0, "y_m": 0}, "there is no robot with index 10"),
        ({"do": "place", "robot": -1, "x_m": 0, "y_m": 0}, "robot"),
        ({"do": "place", "robot": 1, "x_m": 1e9, "y_m": 0}, "x_m"),
        ({"do": "place", "robot": 1, "x_m": float("nan"), "y_m": 0}, "x_m"),
        ({"do": "place", "robot": 1, "x_m": 0}, "place needs y_m"),
        ({"do": "turn", "robot": 1}, "turn needs heading_rad"),
        ({"do": "turn", "robot": 10, "heading_rad": 0}, "there is no robot with index 10"),
        ({"do": "speed", "speed": 0}, "speed"),
        ({"do": "step", "ticks": 0}, "ticks"),
        ({"do": "grid", "order": "pause"}, "there is no Kilogrid"),
        ({"do": "send", "messages": [], "told": "x"}, "messages"),
        (
            {"do": "send", "messages": [{"data": [0], "uid_first": 0, "uid_last": 1}], "told": "x"},
            "data",
        ),
        ({"do": "explode"}, "do"),
        ({"do": "pause", "more": 1}, "more"),
        ({}, "do"),
    ],
)
def test_what_cannot_be_done_is_refused_and_changes_nothing(
    bench: Bench, order: dict[str, Any], why: str
) -> None:
    with pytest.raises(InputError, match=why):
        bench.do(**order)
    assert bench.table.told == []
    assert bench.events == []


def test_its_pace_is_no_steering(bench: Bench) -> None:
    bench.do(do="pause")
    bench.do(do="step")
    bench.do(do="speed", speed=2)
    bench.do(do="speed")
    bench.do(do="resume")
    assert {event["kind"] for event in bench.events} == {PACED}
    assert [event["text"] for event in bench.events] == [
        "paused",
        "goes on to 3.932 s",
        "2 x real time",
        "as fast as it can",
        "goes on",
    ]
    assert bench.table.told == []


def _sent(**order: Any) -> bytes:
    text = json.dumps(order).encode()
    return LENGTH.pack(len(text)) + text


def _head(end: socket.socket) -> dict[str, Any]:
    (length,) = LENGTH.unpack(end.recv(LENGTH.size, socket.MSG_WAITALL))
    return head_of(end.recv(length, socket.MSG_WAITALL))


def allowed(live: Live) -> int:
    """How many ticks the run may go on from 100."""
    live.step(100)
    return live.next_due() - 100


def test_each_order_is_answered_and_a_paused_run_still_shows_itself(bench: Bench) -> None:
    run, end = socket.socketpair()
    with run, end:
        end.settimeout(5)
        live = Live(run.fileno(), bench.table, bench.steering)  # type: ignore[arg-type]
        end.sendall(_sent(do="pause", id=7) + _sent(do="place", id=8, robot=3, x_m=0, y_m=0))
        assert allowed(live) == 0
        assert _head(end)["answer"] == 7
        refused = _head(end)
        assert (refused["answer"], refused["error"]) == (8, "robot 4 has no room there")
        end.sendall(_sent(do="look"))
        live.step(100)
        moment = _head(end)
        assert moment["paused"]
        assert moment["speed"] is None
        assert np.isclose(moment["time_s"], 100 * 0.032768)
        assert moment["arrays"].keys() == {"x_m", "y_m", "heading_rad", "led"}
        end.sendall(_sent(do="look", closely=True) + _sent(do="look"))
        live.step(100)
        assert moment["arrays"].keys() | EXTRA_OF.keys() == _head(end)["arrays"].keys()
        end.sendall(_sent(do="look"))
        live.step(100)
        assert EXTRA_OF.keys().isdisjoint(_head(end)["arrays"])


def test_a_close_look_at_a_grid_tells_how_its_modules_are(bench: Bench) -> None:
    run, end = socket.socketpair()
    with run, end:
        end.settimeout(5)
        live = Live(run.fileno(), bench.table, bench.steering, grid=True)  # type: ignore[arg-type]
        for close in (False, True):
            end.sendall(_sent(do="look", closely=close))
            live.step(100)
            told = _head(end).get("modules")
            assert told == ([[0, 1, "running", "active", 8, 1, 2, 3]] if close else None)


def test_large_swarms_are_looked_at_less_often() -> None:
    assert [chunk_s(robots) for robots in (1, 10_000, 20_000, 1_000_000)] == [0.1, 0.1, 0.2, 0.4]


def test_a_run_whose_viewer_is_gone_goes_on(bench: Bench) -> None:
    run, end = socket.socketpair()
    with run:
        live = Live(run.fileno(), bench.table, bench.steering)  # type: ignore[arg-type]
        end.sendall(_sent(do="pause", id=1))
        assert allowed(live) == 0
        end.close()
        assert allowed(live) > 0


def test_a_run_that_is_only_seen_refuses_orders(bench: Bench) -> None:
    run, end = socket.socketpair()
    with run, end:
        end.settimeout(5)
        live = Live(run.fileno(), bench.table, None)  # type: ignore[arg-type]
        end.sendall(_sent(do="pause", id=1))
        assert allowed(live) > 0
        assert "cannot be steered" in _head(end)["error"]
        assert not select.select([end], [], [], 0)[0]


def test_a_run_with_a_speed_waits_for_the_first_page(bench: Bench) -> None:
    run, end = socket.socketpair()
    with run, end:
        end.settimeout(5)
        live = Live(run.fileno(), bench.table, bench.steering, speed=10)  # type: ignore[arg-type]
        assert allowed(live) == 0
        assert bench.steering.pace.paused
        end.sendall(_sent(do="look"))
        live.step(100)
        moment = _head(end)
        assert (moment["paused"], moment["speed"]) == (False, 10)
        assert bench.events == []  # nobody has steered


def test_a_page_that_opens_with_an_order_starts_the_run_and_has_its_order(bench: Bench) -> None:
    run, end = socket.socketpair()
    with run, end:
        end.settimeout(5)
        live = Live(run.fileno(), bench.table, bench.steering, speed=10)  # type: ignore[arg-type]
        end.sendall(_sent(do="pause", id=1))
        assert allowed(live) == 0
        assert _head(end)["error"] == ""
        end.sendall(_sent(do="look"))
        live.step(100)
        assert _head(end)["paused"]
