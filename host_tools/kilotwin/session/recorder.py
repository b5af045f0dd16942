"""Records an emulated world: what its robots did goes to the writer, and to who watches the run."""

import time
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import numpy as np

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.states import Counts
from kilotwin.metrics.meter import Meter, metrics_summary
from kilotwin.metrics.moment import Moment
from kilotwin.metrics.values import NO_METRICS, MetricValues
from kilotwin.runs.causes import causes
from kilotwin.runs.folder import FAILURES, FAULT, PRINT, UNDEFINED
from kilotwin.runs.trail import CAPACITY, Trail, write_trail
from kilotwin.runs.writer import RunWriter
from kilotwin.session.emulated import EmulatedWorld
from kilotwin.session.loop import NEVER, Attention, Companion, EachSample
from kilotwin.units import ticks

if TYPE_CHECKING:
    from kilotwin._emulator import Event, Samples

_PROGRESS_S = 0.2

Report = Callable[[dict[str, Any]], None]


class Writer(Protocol):
    """Where a trial's records go; `writer.RunWriter` is the one that makes a run folder."""

    def add(self, samples: "Samples", measured: MetricValues = NO_METRICS) -> Counts | None:
        """Takes samples of the engine; returns their counts, None for none."""

    def count(self, samples: "Samples") -> Counts:
        """How many robots do what, in each of the samples."""

    def add_events(self, events: "Iterable[Event | dict[str, Any]]") -> None:
        """Takes events."""


WriterT = TypeVar("WriterT", bound=Writer)


class Recorder(Companion, Generic[WriterT]):
    """Takes samples and events of a world, and measures them."""

    def __init__(
        self,
        world: EmulatedWorld,
        experiment: Experiment,
        writer: WriterT,
        meter: Meter,
        *,
        report: Report,
        attention: Attention,
    ) -> None:
        """`report` receives the run's progress; `attention` says when the recorder takes what there
        is. Metrics that look at the world as it is are measured at samples, where it stops."""
        self._world = world
        self._experiment = experiment
        self.writer = writer
        self.meter = meter
        self._report = report
        self._attention = attention
        self._sample_due = 0 if meter.wants_moments else NEVER
        self.kinds: Counter[str] = Counter()
        """How many events there were of each kind."""
        self._failed: list[dict[str, Any]] = []
        self._undefined: list[dict[str, Any]] = []
        self._faults: Counter[str] = Counter()
        self._last_print: dict[str, Any] | None = None
        self._samples = 0
        self._sampled_at = -1
        self._last: Counts | None = None
        self._reported_at = 0.0

    def step(self, now: int) -> None:
        """Takes what there is, if it is time to."""
        if now >= self.next_due():
            self.take()
            self._attention.step(now)
            if self._sample_due < NEVER:
                sample = self._samples * self._experiment.keys.sample_ticks
                self._sample_due = max(sample, now + 1)

    def next_due(self) -> int:
        """When it takes what there is then."""
        return min(self._attention.next_due(), self._sample_due)

    def take(self) -> None:
        """Takes all samples and events since the last time."""
        samples = self._world.samples()
        last = self._world.over and self._is_now(samples)
        self._add(samples, last=last)

    def finish(self) -> None:
        """Takes the rest; the last moment has a sample in any case."""
        self.take()
        if self._sampled_at != self._world.run_tick:
            self._add(self._world.last_moment(), last=True)

    def take_events(self) -> None:
        """Writes down what happened before now, in order of time."""
        events = self._world.events()
        for event in events:
            if "module" in event:
                continue
            self.kinds[event["kind"]] += 1
            if event["kind"] in FAILURES:
                self._failed.append(event)
            elif event["kind"] == UNDEFINED:
                self._undefined.append(event)
            elif event["kind"] == FAULT:
                self._faults[event["text"]] += 1
            elif event["kind"] == PRINT:
                self._last_print = event
        if events:
            self.writer.add_events(events)

    def _is_now(self, samples: "Samples") -> bool:
        """Whether the last of some samples shows the world as it is."""
        return len(samples["tick"]) > 0 and int(samples["tick"][-1]) == self._world.run_tick

    def _add(self, samples: "Samples", *, last: bool) -> None:
        self.take_events()
        self._samples += len(samples["tick"])
        counts = self.writer.add(samples, self._measure(samples, last=last))
        if counts is None:
            return
        self._sampled_at = int(samples["tick"][-1])
        self._last = counts
        if time.perf_counter() - self._reported_at > _PROGRESS_S:
            self._reported_at = time.perf_counter()
            shown = {"tick": self._world.run_tick, **counts.last(self._experiment.keys)}
            self._report({"type": "progress", **shown, "metrics": self.meter.latest})

    def _measure(self, samples: "Samples", *, last: bool) -> MetricValues:
        if not len(samples["tick"]):
            return NO_METRICS
        failed = len({event["robot"] for event in self._failed})
        has_grid = self._experiment.keys.grid is not None
        moment = Moment(self._world.simulation, failed, has_grid)
        before = set(self.meter.failed)
        measured = self.meter.measure(samples, moment if self._is_now(samples) else None, last=last)
        for name in self.meter.failed.keys() - before:
            what = f"metric {name}: {self.meter.failed[name]}"
            event = {"tick": int(samples["tick"][-1]), "kind": "metric_failed", "text": what}
            self.writer.add_events([event])
        return measured

    def summary(self) -> dict[str, Any]:
        """Events and failures of robots, and how they are in the run's last moment."""
        counts = self._last
        if counts is None:
            counts = self.writer.count(self._world.snapshot())
        return {
            **counts.last(self._experiment.keys),
            "states": counts.shown,
            "prints": {"number": self.kinds[PRINT], "last": self._last_print},
            "events": dict(self.kinds),
            "robots_failed": self._failed,
            "faults": dict(self._faults),
            "causes": [cause.as_dict("robot") for cause in causes(self._failed)],
            "undefined": [cause.as_dict("robot") for cause in causes(self._undefined)],
            "metrics": metrics_summary(self._experiment.keys, self.meter.latest),
            "metrics_failed": self.meter.failed,
        }


class Listener(Companion):
    """Writes down what programs of some robots get in the first seconds from RUN on, and reports it
    once. A grid's lead has messages too, which a robot by itself gets before its RUN."""

    def __init__(
        self, world: EmulatedWorld, robots: Iterable[int], for_s: float, report: Report
    ) -> None:
        self._world = world
        self._robots = list(robots)
        self._until = ticks(for_s)
        self._report = report
        world.simulation.listen_to(self._robots)

    def step(self, now: int) -> None:
        """Reports, when the time is over."""
        if self._robots and now >= self._until:
            self.finish()

    def next_due(self) -> int:
        """Then."""
        return self._until if self._robots else NEVER

    def finish(self) -> None:
        """Reports what there is, if it has not."""
        if not self._robots:
            return
        simulation = self._world.simulation
        heard = {
            robot: [
                (tick, message.hex(), mm)
                for tick, message, mm in simulation.heard_by(robot)
                if tick >= 0
            ]
            for robot in self._robots
        }
        simulation.listen_to([])
        self._robots = []
        self._report({"type": "heard", "heard": heard})


class TrailKeeper(Companion):
    """Has the engine keep a trail, and writes it down at the end."""

    def __init__(self, world: EmulatedWorld, trail: Trail, folder: Path) -> None:
        """Before the robots' first step."""
        self._simulation = world.simulation
        self._folder = folder
        nobody = self._simulation.robots
        robot = trail.robot if trail.end > trail.begin else nobody
        self._simulation.keep_trail(CAPACITY, trail.draws, robot, trail.begin, trail.end)

    def finish(self) -> None:
        """Writes it into the run folder."""
        write_trail(self._folder, self._simulation.arrivals(), self._simulation.trail())


class FrameRecorder(EachSample):
    """Records the frames that robots receive, each sample those since the last one."""

    def __init__(self, world: EmulatedWorld, writer: RunWriter, sample_ticks: int) -> None:
        """Before the robots' first step."""
        super().__init__(sample_ticks)
        self._simulation = world.simulation
        self._writer = writer
        self._simulation.keep_trail(CAPACITY, [], 0, 0, 0)

    def next_due(self) -> int:
        """The next sample, if there is room for more."""
        return super().next_due() if self._writer.wants_frames else NEVER

    def finish(self) -> None:
        """Writes the rest."""
        self._writer.add_frames(self._simulation.arrivals())


class CellRecorder(EachSample):
    """Records what cells show, at the samples at which it is something else than before."""

    def __init__(self, world: EmulatedWorld, writer: RunWriter, sample_ticks: int) -> None:
        super().__init__(sample_ticks)
        self._world = world
        self._writer = writer
        self._shown = np.zeros_like(world.simulation.cells().reshape(-1, 2))

    def finish(self) -> None:
        """Records those that show something else now."""
        shows = self._world.simulation.cells().reshape(-1, 2)
        cells = np.flatnonzero((shows != self._shown).any(axis=1))
        if len(cells):
            self._writer.add_cells(self._world.tick, cells, shows[cells])
        self._shown = shows


class ModuleRecorder(EachSample):
    """Records how a grid's modules are at each sample, and in the last moment."""

    def __init__(self, world: EmulatedWorld, writer: RunWriter, sample_ticks: int) -> None:
        super().__init__(sample_ticks)
        self._world = world
        self._writer = writer
        self._recorded_at = -1

    def finish(self) -> None:
        """Records how they are now, unless they are recorded."""
        if self._recorded_at != self._world.tick:
            self._recorded_at = self._world.tick
            self._writer.add_modules(self._recorded_at, self._world.simulation.modules())
