"""Looks of an `[[expect]]` in one run: the samples that its time asks for."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from kilotwin.experiment.expect_names import Names
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.expression import Expression, Value
from kilotwin.experiment.schema.expect import Expect
from kilotwin.experiment.states import Counts, States, count
from kilotwin.metrics.values import NO_METRICS, MetricValues
from kilotwin.runs.causes import is_mistake, said
from kilotwin.runs.folder import FAILURES, UNDEFINED
from kilotwin.units import TICK_S, seconds

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from kilotwin._emulator import Event, Samples

# Samples are taken at ends of world steps, of 4 ticks at most.
_LATE_S = 4.5 * TICK_S
_KEPT_EVENTS = 1000
_SHOWN_CAUSES = 3


@dataclass(frozen=True)
class Look:
    """One [[expect]] in one run. `seen`: the values that decided, and when."""

    passed: bool
    seen: str


@dataclass(frozen=True)
class Failure:
    """A failure of a robot's or a module's program: `who` and when, what happened, and at which
    line of its sources; `file` is "" where that is not known."""

    who: str
    what: str
    file: str = ""
    line: int = 0

    @classmethod
    def understood(cls, told: dict[str, Any]) -> Self:
        """As a process of its own told it, in which programs run; errors of what is none."""
        return cls(str(told["who"]), str(told["what"]), str(told["file"]), int(told["line"]))


def by_cause(failures: Sequence[Failure]) -> list[tuple[Failure, int]]:
    """The first failure of each cause (a line of the sources, or the same words), and how many
    there are."""
    causes: dict[tuple[Any, ...], list[Failure]] = {}
    for failure in failures:
        key = (failure.file, failure.line) if failure.file else (failure.what,)
        causes.setdefault(key, []).append(failure)
    return [(alike[0], len(alike)) for alike in causes.values()]


def once_per_cause(failures: Sequence[Failure]) -> str:
    """`robot 3 (walk) at 1.2 s: crash at walk.c:42 in loop(): ... (and 4 more like it)`."""
    causes = by_cause(failures)
    parts = []
    for failure, number in causes[:_SHOWN_CAUSES]:
        more = f" (and {number - 1} more like it)" if number > 1 else ""
        parts.append(f"{failure.who}: {failure.what}{more}")
    if len(causes) > _SHOWN_CAUSES:
        parts.append(f"and {len(causes) - _SHOWN_CAUSES} other causes")
    return "; ".join(parts)


class _Looker:
    """Follows one condition through a run."""

    def __init__(self, expect: Expect) -> None:
        assert expect.condition is not None
        self.expression = Expression.of(expect.condition)
        self._at_s = expect.at_s
        self._begin_s = expect.after_s or 0.0
        length_s = expect.throughout_s if expect.within_s is None else expect.within_s
        self._end_s = None if length_s is None else self._begin_s + length_s
        self._wanted = expect.throughout_s is None  # what decides before the end of its time
        self._decided = False
        self._seen: tuple[float, dict[str, Value]] | None = None

    def see(self, time_s: float, names: dict[str, Value]) -> None:
        """A sample; later ones come later."""
        if self._decided:
            return
        if self._at_s is not None:
            if self._seen is None or abs(time_s - self._at_s) < abs(self._seen[0] - self._at_s):
                self._seen = time_s, names
        elif self._end_s is None:
            self._seen = time_s, names
        elif self._begin_s - TICK_S / 2 <= time_s <= self._end_s + _LATE_S:
            # Most samples are like the one before.
            is_alike = self._seen is not None and self._seen[1] == names
            self._seen = time_s, names
            if not is_alike:
                self._decided = self.expression.holds(names) == self._wanted

    def look(self) -> Look:
        """The look at the run, at its end."""
        if self._seen is None:
            return Look(False, "there was no sample at that time")
        time_s, names = self._seen
        values = ", ".join(f"{name} = {_shown(value)}" for name, value in names.items())
        at = f"at {time_s:.4g} s"
        return Look(self.expression.holds(names), f"{values} {at}" if values else at)


def _shown(value: Value) -> str:
    return "no value" if value is None else f"{value:.5g}"


class Looks:
    """Takes the place of a run folder's writer, and keeps what is expected of a run."""

    def __init__(self, experiment: Experiment, *, sees_changes: bool = False) -> None:
        """`sees_changes`: keeps which changes of LEDs samples show, and where robots began."""
        keys = experiment.keys
        self._sees_changes = sees_changes
        self._led: NDArray[np.uint8] | None = None
        self.led_changes: set[tuple[int, int]] = set()
        self.starts: list[list[float]] = []
        self._states, self._sites = States.of(keys), len(keys.site)
        self._names = Names(keys)
        self._lookers = [
            None if expect.condition is None else _Looker(expect) for expect in keys.expect
        ]
        self._failed: dict[Any, int] = {}  # when, by robot
        self.crashes: list[Failure] = []
        self.busy_waits: list[Failure] = []
        self.undefined: list[Failure] = []
        self.mistakes: list[Failure] = []

    def looks(self) -> Sequence[Look | None]:
        """One for each [[expect]]; None of those without a condition."""
        return [None if looker is None else looker.look() for looker in self._lookers]

    def add(self, samples: "Samples", measured: MetricValues = NO_METRICS) -> Counts | None:
        """Looks at samples of the engine."""
        if not len(samples["tick"]):
            return None
        counts = self.count(samples)
        if self._sees_changes:
            self._see_changes(samples)
        for k, tick in enumerate(samples["tick"].tolist()):
            failed = sum(at < tick for at in self._failed.values())
            for looker in self._lookers:
                if looker is not None:
                    wanted = looker.expression.names
                    values = self._names.values(
                        wanted, samples, k, counts, metrics=measured.values, failed=failed
                    )
                    looker.see(seconds(tick), values)
        return counts

    def _see_changes(self, samples: "Samples") -> None:
        """Those of some samples, which are those after the last."""
        led = samples["led"]
        if self._led is None:
            first = [samples[key][0] for key in ("x_m", "y_m", "heading_rad")]
            self.starts = np.stack(first, axis=1).astype(float).tolist()
        rows = led if self._led is None else np.concatenate((self._led, led))
        pairs = np.unique(rows[:-1].astype(np.uint16) << 8 | rows[1:])
        self.led_changes.update((int(pair) >> 8, int(pair) & 255) for pair in pairs)
        self._led = led[-1:].copy()

    def count(self, samples: "Samples") -> Counts:
        """How many robots do what, in each of the samples."""
        return count(self._states, samples["led"], samples["site"], self._sites)

    def add_events(self, events: "Iterable[Event | dict[str, Any]]") -> None:
        """Keeps failures of robots' programs; those of modules are in the run's summary."""
        for event in events:
            if "robot" in event:
                self._keep(event)

    def _keep(self, event: "Event | dict[str, Any]") -> None:
        kind = event["kind"]
        if kind in FAILURES:
            self._failed.setdefault(event["robot"], event["tick"])
        kept = {"busy_wait": self.busy_waits, UNDEFINED: self.undefined}.get(kind)
        kept = self.crashes if kind in FAILURES else kept
        kept = self.mistakes if is_mistake(event) else kept
        if kept is not None and len(kept) < _KEPT_EVENTS:
            kept.append(_failure(event))


def _failure(event: "Event | dict[str, Any]") -> Failure:
    row = dict(event)
    return Failure(
        f"robot {row['uid']} ({row.get('program', '')}) at {seconds(row['tick']):.1f} s",
        said(row),
        row.get("file", ""),
        row.get("line", 0),
    )
