"""The clock that orders live by: the wall's, or that of an emulated world in this process."""

import time
from typing import TYPE_CHECKING, Protocol

from kilotwin.units import TICK_S

if TYPE_CHECKING:
    from kilotwin._emulator import Simulation


class Clock(Protocol):
    """Time, in seconds from any moment on."""

    def now_s(self) -> float:
        """The present moment; it never goes back."""

    def sleep(self, seconds: float) -> None:
        """Returns so much later; at once for 0 or less."""


class WallClock:
    """Real time, or that of a table that goes `speed` times as fast."""

    def __init__(self, speed: float = 1.0) -> None:
        self._speed = speed

    def now_s(self) -> float:
        """Since the machine was started."""
        return time.monotonic() * self._speed

    def sleep(self, seconds: float) -> None:
        """Lets real time pass."""
        if seconds > 0:
            time.sleep(seconds / self._speed)


class SimulatedClock:
    """The time of an engine, which advances while its user sleeps.

    It is finer than the engine's steps: the engine lags behind by less than one.
    """

    def __init__(self, simulation: "Simulation", step_ticks: int) -> None:
        """`step_ticks` are the engine's, as in the experiment."""
        self._simulation, self._step_ticks = simulation, step_ticks
        self._now_s = simulation.tick * TICK_S

    def now_s(self) -> float:
        """Since the world's time 0."""
        return self._now_s

    def sleep(self, seconds: float) -> None:
        """Advances the engine by the whole steps that have come to their end."""
        self._now_s += max(0.0, seconds)
        behind = int(self._now_s / TICK_S + 1e-9) - self._simulation.tick
        if behind >= self._step_ticks:
            self._simulation.advance(behind - behind % self._step_ticks)
