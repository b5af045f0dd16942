"""A run that is watched: what its viewer asks is answered between two calls of the engine."""

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from kilotwin.errors import InputError
from kilotwin.experiment.schema.record import EXTRA_OF
from kilotwin.runs.columns import COUNTERS
from kilotwin.runs.packing import for_page, pack
from kilotwin.session.live_link import LiveLink
from kilotwin.session.loop import NEVER, Companion
from kilotwin.session.pace import Pace
from kilotwin.session.steering import Steering
from kilotwin.units import seconds

if TYPE_CHECKING:
    from kilotwin._emulator import Samples, Simulation

CHUNK_S = 0.1
"""About how long a call of the engine takes then, in CPU time: a viewer wants ten moments a second.
"""
_LONGEST_CHUNK_S = 0.4
_ROBOTS_A_CHUNK = 10_000
_WAIT_S = 0.05  # for a page that asks for a moment
_SHOWN = ("x_m", "y_m", "heading_rad", "led", *EXTRA_OF)
_OBJECTS = ("object_x_m", "object_y_m", "object_heading_rad")


def chunk_s(robots: int) -> float:
    """CPU time of a call of the engine between two looks.

    At each end of one no robot may have been run ahead, and then all are looked at: some 0.2 us of
    each robot, so of large swarms there are fewer looks, that they may take 3 %.
    """
    return min(_LONGEST_CHUNK_S, max(1.0, robots / _ROBOTS_A_CHUNK) * CHUNK_S)


def packed_moment(snapshot: "Samples", zero_tick: int, **more: Any) -> bytes:
    """A snapshot of all robots and objects as a page takes it, with `more` in its head."""
    time_s = seconds(int(snapshot["tick"][0]) - zero_tick)
    shown = [name for name in _SHOWN if name in snapshot]
    columns = {name: snapshot[name][0] for name in shown}  # type: ignore[literal-required]
    if len(snapshot.get("object_x_m", ())):
        columns |= {name: snapshot[name][0] for name in _OBJECTS}  # type: ignore[literal-required]
    return pack({"time_s": time_s, **more}, for_page(columns))


class Live(Companion):
    """Answers the viewer of one run, and lets it be steered."""

    def __init__(
        self,
        descriptor: int,
        simulation: "Simulation",
        steering: Steering | None = None,
        *,
        grid: bool = False,
        zero_tick: Callable[[], int] = lambda: 0,
        waits: Callable[[], None] = lambda: None,
        others: tuple[int, ...] = (),
        speed: float = math.inf,
    ) -> None:
        """Without `steering` it is only seen; `grid`: there are modules to be seen.

        `zero_tick` is that of the run's begin. `waits` is called before it waits while the run may
        not go on: until something comes here or at the descriptors `others`, or for a moment. With
        a finite `speed` it waits for the first page, and then goes so many times real time.
        """
        self._grid = grid
        self._zero_tick = zero_tick
        self._waits = waits
        self._others = others
        self._due = NEVER
        self._link = LiveLink(descriptor)
        self._simulation = simulation
        self._steering = steering
        self._asked = self._closely = False
        self._awaits_page = steering is not None and not math.isinf(speed)
        if steering is not None and self._awaits_page:
            steering.pace = Pace(speed, paused=True)

    def step(self, now: int) -> None:
        """Does what was asked for; waits a moment if the run may not go on."""
        self.heed()
        self._due = NEVER
        if self._steering is None:
            return
        pace = self._steering.pace
        self._due = now + pace.ticks(time.monotonic(), now)
        if self._due == now:
            self._waits()
            self._link.wait(min(_WAIT_S, pace.wait_s(time.monotonic(), now)), *self._others)

    def next_due(self) -> int:
        """How far the run may go."""
        return self._due

    def heed(self) -> None:
        """Does what was asked for since the last call."""
        for order in self._link.orders():
            self._begin()
            if order.get("do") == "look":
                self._asked = True
                self._closely |= order.get("closely") is True
            else:
                self._answer(order)
        self._link.flush()
        if self._asked and self._link.is_free:
            closely, self._asked, self._closely = self._closely, False, False
            look = self._simulation.close_look if closely else self._simulation.snapshot
            more = self._modules() if closely else {}
            self._link.send(packed_moment(look(), self._zero_tick(), **self._pace(), **more))
        if self._link.closed and self._steering is not None and self._steering.pace.paused:
            self._steering.pace = Pace()  # no page is left to have it go on

    def _begin(self) -> None:
        """The run goes on once a page has asked for something."""
        if self._awaits_page and self._steering is not None:
            self._awaits_page = False
            self._steering.pace.resume(time.monotonic(), self._simulation.tick)

    def _answer(self, order: dict[str, Any]) -> None:
        error = "this run cannot be steered: hosts outside, or nobody, steer it"
        if self._steering is not None:
            error = ""
            try:
                self._steering.do(order)
            except InputError as refusal:
                error = str(refusal)
        self._link.send(pack({"answer": order.get("id"), "error": error}, {}))

    def _modules(self) -> dict[str, Any]:
        """How modules are, if there is a grid: x, y and COUNTERS of each."""
        if not self._grid:
            return {}
        names = ("x", "y", *COUNTERS)
        modules = self._simulation.modules()
        rows = [[module[name] for name in names] for module in modules]  # type: ignore[literal-required]
        return {"modules": rows}

    def _pace(self) -> dict[str, Any]:
        pace = Pace() if self._steering is None else self._steering.pace
        return {"paused": pace.paused, "speed": None if math.isinf(pace.speed) else pace.speed}
