"""How far a run may go now: as fast as it can, so many times real time, not at all, or some steps.

Pure: the wall's time is an argument.
"""

import math

from kilotwin.session.loop import NEVER
from kilotwin.units import TICK_S

LEAST_SPEED = 0.01
MOST_SPEED = 10_000.0
MOST_STEP_TICKS = 1_000_000


class Pace:
    """`speed` is in simulated seconds per second; infinite: as fast as it can."""

    def __init__(self, speed: float = math.inf, *, paused: bool = False) -> None:
        self.speed = speed
        self.paused = paused
        self._stop_at = NEVER  # a tick: then it pauses
        self._from = (0.0, 0)  # wall time and tick since which the speed holds

    def pause(self) -> None:
        """Nothing goes on until resume() or step()."""
        self.paused = True
        self._stop_at = NEVER

    def resume(self, now_s: float, tick: int) -> None:
        """Goes on, at the speed that was set."""
        self.paused = False
        self._stop_at = NEVER
        self._from = now_s, tick

    def step(self, now_s: float, tick: int, to_tick: int) -> None:
        """Goes on up to `to_tick`, and pauses there."""
        self.resume(now_s, tick)
        self._stop_at = to_tick

    def go_at(self, now_s: float, tick: int, speed: float) -> None:
        """Has this speed from now on."""
        self.speed = speed
        self._from = now_s, tick

    def ticks(self, now_s: float, tick: int) -> int:
        """How many ticks may go by now; pauses where a step() ends."""
        if not self.paused and tick >= self._stop_at:
            self.pause()
        if self.paused:
            return 0
        left = self._stop_at - tick
        if math.isinf(self.speed):
            return left
        since_s, since_tick = self._from
        due = since_tick + math.floor((now_s - since_s) * self.speed / TICK_S)
        return max(0, min(left, due - tick))

    def wait_s(self, now_s: float, tick: int) -> float:
        """How long until ticks() may be above 0; infinite when paused."""
        if self.paused:
            return math.inf
        if math.isinf(self.speed):
            return 0.0
        since_s, since_tick = self._from
        return max(0.0, since_s + (tick + 1 - since_tick) * TICK_S / self.speed - now_s)
