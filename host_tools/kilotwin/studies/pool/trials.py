"""Batches of trials from Python, as an evolution, or any search of one's own, asks for them."""

import os
import struct
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from kilotwin.errors import InputError, RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.states import Counts, States, count
from kilotwin.experiment.text import Setting, parse_setting
from kilotwin.metrics.values import NO_METRICS, MetricValues
from kilotwin.programs.group import settled
from kilotwin.runs.causes import robots_failed
from kilotwin.session.world import experiment_for, plain
from kilotwin.studies.pool.built import Builder
from kilotwin.studies.pool.places import Processes
from kilotwin.studies.pool.pool import Pool
from kilotwin.studies.pool.task import Failed, Outcome, Ran, Task

if TYPE_CHECKING:
    from kilotwin._emulator import Event, Samples

__all__ = ["Trials"]


class Trials:
    """Trials of one experiment, each with settings of its own, in processes of this computer.

        with Trials("my.toml", metrics=["spread"]) as trials:
            values = trials([{"controller.beta": beta, "seed": 1} for beta in (1.0, 2.0)])

    The processes begin with the first batch and stay until the end, with programs and engine
    loaded: a batch of 100 trials of 20 robots and 60 s takes less than a second. A trial does what
    `World` and `kilotwin run` do with the same settings, bit for bit, and is confined as they are
    (docs/security.md). Nothing is recorded.
    """

    def __init__(
        self,
        experiment: str | Path | None = None,
        *,
        metrics: Sequence[str] = (),
        workers: int | None = None,
        set: str | Sequence[str] = (),
        trial_timeout_s: float | None = None,
        **keys: Any,
    ) -> None:
        """Takes an experiment file, or `keys`, as `World` takes them; then `duration_s` is one.

        `metrics`: names of its [metric]s, `not_resting` or `resting_SITE`; all its [metric]s if
        left out. `workers`: how many trials run at a time, 1 or more; one per core if left out.
        `set`: settings of all trials, as `--set` takes them. `trial_timeout_s`: wall time in s that
        a trial may take, above 0. InputError says what cannot be used.
        """
        self._given = None if experiment is None else str(experiment)
        self._keys = keys
        if experiment is None and "duration_s" not in keys:
            raise InputError("Trials: how long is a trial? Add duration_s=60")
        self._settings = [parse_setting(text) for text in ([set] if isinstance(set, str) else set)]
        if workers is not None and workers < 1:
            raise InputError(f"Trials: workers is {workers}; it must be 1 or more")
        if trial_timeout_s is not None and not trial_timeout_s > 0:
            raise InputError(f"Trials: trial_timeout_s is {trial_timeout_s}; it must be above 0")
        self._timeout_s = trial_timeout_s
        first = self._experiment([])
        self.metrics = tuple(metrics) or tuple(first.keys.metric)
        """The metrics' names, in the order of the columns."""
        known = [*first.keys.metric, *_counted(first)]
        for name in self.metrics:
            if name not in known:
                has = ", ".join(known)
                raise InputError(
                    f"Trials: {first.origin.source} has no metric '{name}'; it has {has}"
                )
        if not self.metrics:
            raise InputError(
                f"Trials: {first.origin.source} has no [metric]; add one (docs/metrics.md), or "
                f"name one of {', '.join(known)}"
            )
        for note in first.notes():
            warnings.warn(note, stacklevel=2)
        self._builder = Builder(at_once=False)
        self._pool = Pool(Processes(workers or len(os.sched_getaffinity(0))))
        self.reasons: list[str] = []
        """Why each trial of the last batch failed; "" of those that did not."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends the processes; another batch begins new ones."""
        self._pool.close()

    def __call__(self, sets: Iterable[Mapping[str, Any]]) -> NDArray[np.float64]:
        """Runs a trial for each set of settings; returns [sets, metrics], their values at the end.

        A set has any keys that `--set` takes, with Python's or numpy's values: `seed`,
        `controller.beta`, `parameters.gain` of a program's own ([parameters](parameters.md)),
        `robots.0.define`. `poses` are those of the first robots, [robots, 3]: x_m, y_m,
        heading_rad. A value is NaN where a metric has none, and all are where a trial failed, whose
        reason is in `reasons`. InputError for a set that is no experiment, before any is run;
        RunError if processes die again and again. Ctrl-C ends a batch.
        """
        tasks = [self._task(number, dict(one)) for number, one in enumerate(sets)]
        values = np.full((len(tasks), len(self.metrics)), np.nan)
        self.reasons = [""] * len(tasks)
        for index, answer in self._pool.answers(tasks):
            if isinstance(answer, Failed):
                self.reasons[index] = answer.reason
            else:
                values[index] = answer.value
        return values

    def _task(self, number: int, given: dict[str, Any]) -> Task[Sequence[float]]:
        settings = [self._setting(number, key, plain(value)) for key, value in given.items()]
        experiment = settled(self._experiment(settings), _warn)
        return Task(
            experiment,
            Values(self.metrics),
            self._builder.built(experiment).keys,
            self._timeout_s,
            "trial_timeout_s",
            Task.trusts(),
        )

    def _setting(self, number: int, key: str, value: Any) -> Setting:
        shown = repr(value)
        shown = shown if len(shown) < 80 else f"{shown[:76]} ..."
        path = "robots.0.poses" if key == "poses" else key
        return Setting(tuple(path.split(".")), value, f"Trials: set {number}: {key} = {shown}")

    def _experiment(self, settings: list[Setting]) -> Experiment:
        return experiment_for(self._given, self._keys, [*self._settings, *settings], "Trials")


def _warn(note: str) -> None:
    warnings.warn(note, stacklevel=3)


def _counted(experiment: Experiment) -> list[str]:
    """Counts that every trial has beside its metrics."""
    return ["not_resting", *(f"resting_{site.name}" for site in experiment.keys.site)]


@dataclass(frozen=True)
class Values(Outcome["Last", Sequence[float]]):
    """Metrics, or counts of robots, at a trial's end; NaN for none."""

    names: tuple[str, ...]

    def writer(self, experiment: Experiment) -> "Last":
        """Keeps nothing but the last moment."""
        return Last(experiment)

    def answer(self, ran: "Ran[Last]") -> bytes:
        """The values. RunError where a robot's program, or a metric's function, failed."""
        summary = ran.summary
        if summary["robots_failed"]:
            raise RunError(robots_failed(summary["robots_failed"]))
        for name in self.names:
            if name in summary["metrics_failed"]:
                raise RunError(f"metric {name}: {summary['metrics_failed'][name]}")
        counts = {
            "not_resting": summary["not_resting"],
            **{f"resting_{site}": number for site, number in summary["resting"].items()},
        }
        found = {name: one["value"] for name, one in summary["metrics"].items()}
        values = [{**counts, **found}.get(name) for name in self.names]
        return struct.pack(
            f"{len(values)}d", *(np.nan if value is None else value for value in values)
        )

    def understood(self, task: Task[Sequence[float]], said: bytes) -> Sequence[float]:
        """ValueError of another number of values."""
        try:
            return struct.unpack(f"{len(self.names)}d", said)
        except struct.error:
            raise ValueError from None


class Last:
    """Counts robots, in place of a run folder's writer."""

    def __init__(self, experiment: Experiment) -> None:
        self._states, self._sites = States.of(experiment.keys), len(experiment.keys.site)

    def add(self, samples: "Samples", measured: MetricValues = NO_METRICS) -> Counts | None:
        """Keeps none of them."""
        return self.count(samples) if len(samples["tick"]) else None

    def count(self, samples: "Samples") -> Counts:
        """How many robots do what, in each of the samples."""
        return count(self._states, samples["led"], samples["site"], self._sites)

    def add_events(self, events: "Iterable[Event | dict[str, Any]]") -> None:
        """Keeps none of them."""
