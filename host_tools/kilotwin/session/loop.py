"""The one loop of all runs: what takes part in a run acts, and the table goes on in between."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from typing import Any

NEVER = 2**62
"""A tick that no run reaches."""


class Table(ABC):
    """The ground of a run: an emulated world, or robots at the end of buses and serial lines."""

    @property
    @abstractmethod
    def tick(self) -> int:
        """Its time now: ticks of 32.768 ms, below 0 while it is set up."""

    @property
    @abstractmethod
    def over(self) -> bool:
        """Whether the run is over."""

    @abstractmethod
    def advance(self, to: int) -> None:
        """Goes on to the tick `to`, or less far: a real table returns after a moment."""


class Companion:
    """A participant of a run beside the robots: a grid's host, a viewer, the recorder ..."""

    def step(self, now: int) -> None:
        """Does what is due at the tick `now`, and nothing else: it may be called at any tick, and
        again at the same one."""

    def next_due(self) -> int:
        """The tick of its next act. The table does not go beyond it; it stays where it is if that
        is now."""
        return NEVER

    def summary(self) -> dict[str, Any]:
        """Its part of the run's summary, by key."""
        return {}

    def finish(self) -> None:
        """The run stands still: does what is left to do for its last moment."""

    def close(self) -> None:
        """Ends what it has open."""


class Each(Companion):
    """A companion that acts each time."""

    def __init__(self, act: Callable[[], None]) -> None:
        self._act = act

    def step(self, now: int) -> None:
        """Acts."""
        self._act()


class EachTick(Companion):
    """A companion that acts once a tick."""

    _due = -NEVER

    def step(self, now: int) -> None:
        """Acts, if it has not yet at this tick."""
        if now >= self._due:
            self._due = now + 1
            self.act(now)

    def next_due(self) -> int:
        """The next tick."""
        return self._due

    @abstractmethod
    def act(self, now: int) -> None:
        """Its act at the tick `now`."""


class EachSample(Companion):
    """A companion that does at each sample what it does at the end."""

    def __init__(self, sample_ticks: int) -> None:
        self._sample_ticks = sample_ticks
        self._next = 0

    def step(self, now: int) -> None:
        """Acts, if this is a sample and it has not yet."""
        if now >= self._next:
            self.finish()
            self._next = (now // self._sample_ticks + 1) * self._sample_ticks

    def next_due(self) -> int:
        """The next sample."""
        return self._next


class Attention(Companion):
    """Has the loop come round after about `every_s` of wall time, however fast the table is: until
    then no signal is seen and no progress is shown."""

    def __init__(
        self, every_s: float, clock: Callable[[], float] = time.perf_counter, *, first: int = 1
    ) -> None:
        """`first`: ticks that surely take less than that, before any were seen."""
        self._every_s = every_s
        self._clock = clock
        self._from = self._due = -NEVER
        self._at_s = 0.0
        self._ticks = first

    def step(self, now: int) -> None:
        """Learns from what the ticks since the last time took how many are to be next."""
        if now < self._due:
            return
        at_s = self._clock()
        if self._from > -NEVER:
            passed, took_s = now - self._from, max(at_s - self._at_s, 1e-6)
            self._ticks = max(1, min(4 * passed, round(passed * self._every_s / took_s)))
        self._from, self._at_s, self._due = now, at_s, now + self._ticks

    def next_due(self) -> int:
        """When it is to come round."""
        return self._due


class Session:
    """A table, and its companions in the order in which they act."""

    def __init__(self, table: Table, companions: Iterable[Companion]) -> None:
        self._table = table
        self._companions = list(companions)

    def run(self, stopped: Callable[[], bool] = lambda: False) -> None:
        """Until the table's run is over, or `stopped`.

        The result does not depend on how often the loop comes round: companions act at their ticks,
        and a table is at a tick what it is however it came there.
        """
        table, companions = self._table, self._companions
        while not table.over and not stopped():
            now = table.tick
            for companion in companions:
                companion.step(now)
            due = min(companion.next_due() for companion in companions)
            if due > now:
                table.advance(due)
        for companion in companions:
            companion.finish()
