"""A table that lives by the wall, real or emulated elsewhere, and the recorder of what is seen of
its robots."""

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.informed import informed_for
from kilotwin.metrics.functions import LocalFunctions
from kilotwin.metrics.meter import Meter, metrics_summary
from kilotwin.runs.writer import RunWriter
from kilotwin.session.display import Display
from kilotwin.session.loop import Companion, Table
from kilotwin.units import TICK_S, ticks

if TYPE_CHECKING:
    from kilotwin._emulator import Samples

_PROGRESS_S = 0.5


class WallTable(Table):
    """Time goes by itself. `speed`: seconds of the experiment per second, as an emulated table has
    it; `lead_s`: how long before 0 it begins; `step_s`: wall time between two rounds of the loop.
    """

    def __init__(
        self,
        step_s: float,
        over: Callable[[], bool],
        *,
        speed: float = 1.0,
        lead_s: float = 0.0,
    ) -> None:
        self._step_s = step_s
        self._over = over
        self._speed = speed
        self._lead_s = lead_s
        self.start()

    def start(self) -> None:
        """Its time begins now."""
        self._began = time.monotonic()

    @property
    def wall_s(self) -> float:
        """How long it has been there."""
        return time.monotonic() - self._began

    @property
    def now_s(self) -> float:
        """The experiment's time."""
        return self.wall_s * self._speed - self._lead_s

    @property
    def tick(self) -> int:
        """The same in ticks."""
        return math.floor(self.now_s / TICK_S)

    @property
    def over(self) -> bool:
        """As its maker has it."""
        return self._over()

    def advance(self, to: int) -> None:
        """Lets a moment pass."""
        time.sleep(self._step_s)


def meter_of(experiment: Experiment) -> Meter:
    """The metrics of an experiment on a real table, where programs' variables cannot be read."""
    functions = LocalFunctions(experiment) if experiment.functions else None
    return Meter(experiment, functions)


class SeenRecorder(Companion):
    """Writes a sample of how robots were last seen, each `record.sample_s` of the run."""

    def __init__(
        self,
        experiment: Experiment,
        writer: RunWriter,
        meter: Meter,
        display: Display,
        *,
        run_s: Callable[[], float],
        seen: Callable[[int], "Samples"],
    ) -> None:
        """`run_s`: the run's time, below 0 while it does not run; `seen`: robots as a sample of a
        tick."""
        self._keys = experiment.keys
        self._writer = writer
        self._meter = meter
        self._display = display
        self._run_s = run_s
        self._seen = seen
        self._next = 0
        self._shown_at = -math.inf
        self._robots: dict[str, Any] = {}
        self._states: dict[str, int] = {}

    def step(self, now: int) -> None:
        """Writes one, if it is time to."""
        run_s, sample_s = self._run_s(), self._keys.record.sample_s
        if run_s >= self._next * sample_s:
            self._next = int(run_s / sample_s) + 1
            self.write(run_s)

    def write(self, run_s: float, *, last: bool = False) -> None:
        """Writes one now."""
        sample = self._seen(ticks(run_s))
        counts = self._writer.add(sample, self._meter.measure(sample, None, last=last))
        assert counts is not None
        self._robots, self._states = counts.last(self._keys), counts.shown
        if time.monotonic() - self._shown_at > _PROGRESS_S:
            self._shown_at = time.monotonic()
            self._display.progress(ticks(run_s), **self._robots, metrics=self._meter.latest)

    def summary(self) -> dict[str, Any]:
        """How robots were last seen, and the metrics then."""
        return {
            **self._robots,
            "states": self._states,
            "metrics": metrics_summary(self._keys, self._meter.latest),
            "metrics_failed": self._meter.failed,
        }


def recorded_summary(
    experiment: Experiment, table: WallTable, writer: RunWriter, status: str, run_s: float
) -> dict[str, Any]:
    """The part of the summary that all recordings have, beside their companions'."""
    return {
        "experiment": experiment.keys.name,
        "seed": experiment.keys.seed,
        "status": status,
        "duration_s": experiment.keys.duration_s,
        "recorded_s": round(run_s, 3),
        "robots": experiment.size,
        "informed": informed_for(experiment.keys),
        "wall_s": round(table.wall_s, 3),
        "run_folder": str(writer.folder),
    }
