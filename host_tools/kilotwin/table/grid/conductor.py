"""Takes a grid through an experiment: set-up, run at 0, what the file says in mid-run, idle.

Its clock begins before 0, so that the set-up is done by then; a set-up that takes longer moves the
begin of the run. All times that it reports are since the begin of the run.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal, Protocol

from kilotwin.experiment.spec.grid_plan import GridPlan, Order
from kilotwin.table.grid.controller import SETTLE_S, Controller
from kilotwin.table.grid.in_turn import rounds_of
from kilotwin.table.grid.links import Links
from kilotwin.table.grid.poller import Reports

Phase = Literal["set-up", "ready", "running", "ending", "done"]

# Time that set-up takes besides repeating messages: settling, sweeps, a frame of each transfer.
_BETWEEN_S = 0.6
_VERIFY_S = 4.5
# It takes about 4 s to leave robots and modules idle.
_ENDING_S = 12.0


class Listener(Protocol):
    """Receives what the grid reports; times are since the begin of the run."""

    def reports(self, reports: Reports) -> None:
        """Takes reports of robots, in order of time."""

    def event(self, time_s: float, kind: str, text: str, **more: Any) -> None:
        """Takes an event."""


class Conductor:
    """One experiment on one grid."""

    def __init__(
        self,
        plan: GridPlan,
        messages: Sequence[bytes],
        duration_s: float,
        links: Links,
        listener: Listener,
        *,
        join: bool = False,
        poll_window: int | None = None,
    ) -> None:
        """`messages` are for robots, before the run. `join`: the grid runs already.

        `poll_window` in place of the plan's.
        """
        self._plan = plan
        self._messages = messages
        self._duration_s = duration_s
        self._listener = listener
        window = plan.settings.poll_window if poll_window is None else poll_window
        settings = replace(plan.settings, poll_window=window)
        self.controller = Controller(plan.layout, settings, links, self)
        self._orders: deque[Order] = deque() if join else deque(plan.orders)
        self._join = join
        self._begun = False
        self._ending_since_s: float | None = None
        self.phase: Phase = "set-up"
        self.zero_s = 0.0
        """When the run began, by the caller's clock."""
        self.unsent: list[int] = []
        """Buses that could not take the frames that stop their robots and modules."""

    def step(self, now_s: float) -> None:
        """Does what is due; call it at `next_step_s` at the latest."""
        self.controller.step(now_s)
        if not self._begun:
            self._begun = True
            self._begin(now_s)
        elif self.phase == "set-up" and not self.controller.busy:
            self.phase = "ready"
        if self.phase == "ready" and now_s >= self.zero_s:
            self._run(now_s)
        if self.phase == "running":
            self._carry_out(now_s - self.zero_s)
        elif self.phase == "ending":
            self._await_idle(now_s)

    def next_step_s(self) -> float:
        """By the caller's clock."""
        times = [self.controller.next_step_s()]
        if self.phase == "ready":
            times.append(self.zero_s)
        if self.phase == "running":
            times.append(self.zero_s + self._duration_s)
            if self._orders:
                times.append(self.zero_s + self._orders[0].at_s)
        return min(times)

    def end(self) -> None:
        """Leaves robots and modules idle, whatever goes on; `phase` is done when they are."""
        if self.phase not in ("ending", "done"):
            self.controller.set_idle()
            self.phase = "ending"
            self._ending_since_s = None

    def leave(self) -> None:
        """Ends without a frame: the grid runs on."""
        self.phase = "done"

    def _await_idle(self, now_s: float) -> None:
        """Waits until all is idle, but not for ever for a bus that does not work any more."""
        if self._ending_since_s is None:
            self._ending_since_s = now_s
        controller = self.controller
        if controller.busy and now_s - self._ending_since_s <= _ENDING_S:
            return
        everywhere = list(range(self._plan.layout.buses)) if controller.busy else []
        if buses := controller.unsent or everywhere:
            self.unsent = buses
            where = "bus " + ", ".join(map(str, buses))
            what = f"robots and modules on {where} could not be told to stop: they may be going on"
            self.event(now_s, "not_idle", what, buses=buses)
        self.phase = "done"

    def _begin(self, now_s: float) -> None:
        if self._join:
            self.zero_s = now_s
            self.phase = "running"
            self.controller.configuration = dict(self._plan.configuration)
            self.controller.watch()
            self.event(now_s, "join", "polls modules that run already")
        else:
            self.controller.set_up(self._plan.configuration, self._messages)

    def _run(self, now_s: float) -> None:
        self.zero_s = now_s
        self.phase = "running"
        self.controller.run()
        self.controller.step(now_s)

    def _carry_out(self, time_s: float) -> None:
        if time_s >= self._duration_s:
            self.end()
            return
        # One order after the other, each when the last one is done.
        while self._orders and self._orders[0].at_s <= time_s and not self.controller.busy:
            order = self._orders.popleft()
            if order.kind == "pause":
                self.controller.pause()
            elif order.kind == "resume":
                self.controller.resume()
            elif order.configuration:
                self.controller.change(order.configuration)

    # Reports of the controller, by the caller's clock.

    def reports(self, reports: Reports) -> None:
        """Passes reports on."""
        reports.at_s[:] -= self.zero_s
        self._listener.reports(reports)

    def event(self, now_s: float, kind: str, text: str, **more: Any) -> None:
        """Passes an event on."""
        self._listener.event(now_s - self.zero_s, kind, text, **more)


def set_up_s(plan: GridPlan, messages: int, step_s: float) -> float:
    """How long before 0 to begin, for a caller that steps every `step_s`: rather more than less."""
    settings = plan.settings
    repeated = 1 + settings.rounds * messages
    modules = math.ceil(plan.layout.rows / plan.layout.buses) * plan.layout.columns
    rounds = rounds_of(plan.configuration.values())
    frames = 9 * modules * rounds or 3
    if settings.health:
        frames += 2 * modules
    return (
        repeated * (settings.hold_s + _BETWEEN_S + 4 * step_s)
        + frames * max(settings.pace_s, 0.005, step_s)
        + max(rounds - 1, 0) * (SETTLE_S + 2 * step_s)
        + _VERIFY_S
    )
