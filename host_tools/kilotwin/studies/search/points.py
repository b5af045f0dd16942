"""Points of a search, measured by trials of one growing sweep: none is run twice."""

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from kilotwin.errors import InputError, InterruptError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import ExperimentText, Setting
from kilotwin.runs.folder import slug
from kilotwin.studies.pool.places import Place
from kilotwin.studies.pool.pool import Pool
from kilotwin.studies.search.space import Point, settings_of
from kilotwin.studies.sweep.measure import RESULT, table_of
from kilotwin.studies.sweep.plan import Plan, SweepSchema, Trial
from kilotwin.studies.sweep.runner import Display, Sweep

Values = dict[str, float | None]
"""Metrics of a trial by name; None of what has no value at the end."""


@dataclass
class Laboratory:
    """Measures points. All trials are in the data set of `folder`, whatever measured them."""

    file: Path
    settings: list[Setting]
    metrics: Sequence[str]
    folder: Path
    place: Place
    display: Display
    trial_timeout_s: float | None = None
    _trials: dict[tuple[str, int], Trial] = field(default_factory=dict)
    _found: dict[tuple[str, int], Values | None] = field(default_factory=dict)
    _text: str = ""
    _pool: Pool = field(init=False)
    _duration_s: float = 0.0

    def __post_init__(self) -> None:
        self._pool = Pool(self.place)

    def open(self, folder: Path | None, what: str) -> None:
        """Reads the experiment; the data set is in `folder`, or in runs/WHAT-NAME.

        InputError for a metric that it does not have, and for a seed.
        """
        for setting in self.settings:
            if setting.keys == ("seed",):
                raise InputError(f"{setting.written}: a search has its own seeds; leave it out")
        experiment = Experiment.load(self.file, self.settings)
        self._text = self.file.read_text()
        keys = experiment.keys
        self._duration_s = keys.duration_s
        known = [
            *keys.metric,
            "not_resting",
            *(f"resting_{site.name}" for site in keys.site),
        ]
        for name in self.metrics:
            if name not in known:
                has = ", ".join(known)
                raise InputError(f"--metric {name}: {self.file} has no such metric; it has {has}")
        self.folder = folder or Path("runs") / f"{what}-{slug(keys.name)}"

    def measure(
        self, points: Sequence[Point], seeds: Iterable[int], *, share: float = 1.0
    ) -> list[list[Values | None]]:
        """Results of each point, at each seed, None of a failed trial. Runs what is not there yet.

        `share`: of the experiment's duration, for shorter trials. InterruptError if it was
        interrupted; what was run is kept.
        """
        seeds = list(seeds)
        found = iter(self.measure_each([(one, seed) for one in points for seed in seeds], share))
        return [[next(found) for _ in seeds] for _ in points]

    def measure_each(
        self, wanted: Iterable[tuple[Point, int]], share: float = 1.0
    ) -> list[Values | None]:
        """The same of points with a seed each."""
        keys = [self._add(point, seed, share) for point, seed in wanted]
        if new := [key for key in dict.fromkeys(keys) if key not in self._found]:
            self._run(new)
        return [self._found[key] for key in keys]

    def make_folder(self) -> None:
        """Makes the data set's folder, for what else is to stand in it."""
        sweep = self._sweep([])
        with sweep.data.held():
            sweep.data.begin(sweep.plan, sweep.keys)

    def close(self) -> None:
        """Writes the tables of all trials, which are no part of the search; ends the workers."""
        self._pool.close()
        if self._found:
            sweep = self._sweep([self._trials[key] for key in self._found])
            with sweep.data.held():
                sweep.data.begin(sweep.plan, sweep.keys)
                sweep.finish()

    def _add(self, point: Point, seed: int, share: float) -> tuple[str, int]:
        if share < 1:
            point = {**point, "duration_s": self._duration_s * share}
        key = (json.dumps(point, sort_keys=True), seed)
        if key not in self._trials:
            seeded = Setting(("seed",), seed, f"seed {seed}")
            given = [*self.settings, *settings_of(point), seeded]
            experiment = Experiment.load(self.file, given)
            index = len(self._trials)
            self._trials[key] = Trial(index, self.file.stem, seed, point, experiment)
        return key

    def _run(self, wanted: Sequence[tuple[str, int]]) -> None:
        """Those trials alone: a search of many batches would look at all others in each."""
        sweep = self._sweep([self._trials[key] for key in wanted])
        if sweep.missing():
            with sweep.data.held():
                sweep.run(self._pool, self.display)
            if sweep.interrupted:
                what = f"interrupted; the same command goes on from here ({self.folder})"
                raise InterruptError(what)
        for key, part in zip(wanted, sweep.keys, strict=True):
            self._found[key] = self._values(sweep, part)

    def _sweep(self, trials: Sequence[Trial]) -> Sweep:
        indexed = [replace(trial, index=index) for index, trial in enumerate(trials)]
        schema = SweepSchema(
            name=self.folder.name, base=[self.file.name], trial_timeout_s=self.trial_timeout_s
        )
        origin = ExperimentText(str(self.file), Path(), {}, "", [])
        plan = Plan(schema, self._text, origin, indexed)
        return Sweep.prepare(plan, self.folder, self.display.note)

    def _values(self, sweep: Sweep, key: str) -> Values | None:
        stream = sweep.data.parts.read(key) if key in sweep.there else None
        if stream is None:
            return None
        table = table_of(stream)
        result: dict[str, Any] = json.loads(table.schema.metadata[RESULT])
        values: Values = {}
        for name in self.metrics:
            if name in result.get("metrics", {}):
                values[name] = result["metrics"][name]["value"]
            else:
                last = table[name][-1].as_py()
                values[name] = None if last is None else float(last)
        return values

    @property
    def trials(self) -> int:
        """How many were asked for so far."""
        return len(self._trials)


def mean_of(values: Sequence[Values | None], metric: str) -> float:
    """Over repeats; NaN if one of them failed or has no value."""
    numbers = [math.nan if one is None or one[metric] is None else one[metric] for one in values]
    return float(np.mean(numbers))  # type: ignore[arg-type]
