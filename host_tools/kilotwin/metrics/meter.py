"""Measures all metrics of an experiment, sample by sample."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.metric import Metric
from kilotwin.metrics.builtins import Measure, builtin
from kilotwin.metrics.functions import Functions, Values
from kilotwin.metrics.moment import Moment
from kilotwin.metrics.sample import Row, SampleMaker, row_of
from kilotwin.metrics.values import NO_METRICS, MetricValues
from kilotwin.units import seconds

if TYPE_CHECKING:
    from kilotwin._emulator import Samples
    from kilotwin.metrics.variables import Variable

_OF_A_MOMENT = ("messages", "message_rate", "survival")


class Meter:
    """The metrics of one run."""

    def __init__(
        self,
        experiment: Experiment,
        functions: Functions | None,
        symbols: Sequence[Path | None] | None = None,
    ) -> None:
        """`symbols`: files of debug information, of each group; None of a real table, whose robots
        have no variables to read. `functions` may be None where the experiment has none."""
        keys = experiment.keys
        self._metrics = keys.metric
        self._at_samples = {
            name: metric for name, metric in keys.metric.items() if metric.when == "samples"
        }
        self._functions = functions
        self._make = SampleMaker(keys)
        self._builtins: dict[str, Measure] = {
            name: builtin(metric, keys)
            for name, metric in keys.metric.items()
            if metric.builtin not in (None, "first_time")
        }
        self._variables: dict[str, Variable] = {}
        if symbols is not None:
            from kilotwin.metrics import variables

            self._variables = {
                name: variables.Variable(experiment, name, symbols)
                for name, metric in keys.metric.items()
                if metric.variable is not None
            }
        self._reached: dict[str, float] = {}
        self.latest: Values = dict.fromkeys(keys.metric)
        """The newest value of each, None of what has none."""

    @property
    def failed(self) -> dict[str, str]:
        """Place and cause of each failure, by the metric whose function failed."""
        return {} if self._functions is None else self._functions.failed

    @property
    def wants_moments(self) -> bool:
        """Whether the engine has to stand still at each sample: for what is not in samples, and
        since the failure of a function is an event of that moment."""
        metrics = self._metrics.values()
        return any(
            metric.variable is not None
            or metric.function is not None
            or metric.builtin in _OF_A_MOMENT
            for metric in metrics
            if metric.when == "samples"
        )

    def measure(
        self, samples: "Samples", moment: Moment | None, *, last: bool = False
    ) -> MetricValues:
        """The values at these samples; `moment` is that of the last of them, `last` of the run."""
        if not self._metrics:
            return NO_METRICS
        count, robots = samples["led"].shape
        measured = MetricValues({name: np.full(count, np.nan) for name in self._metrics})
        for name, metric in self._metrics.items():
            if metric.per_robot:
                measured.of_robots[name] = np.full((count, robots), np.nan)
        cells = None if moment is None or not self._functions else moment.cells
        for k in range(count):
            is_now = k == count - 1
            wanted = self._metrics if last and is_now else self._at_samples
            if not wanted:
                continue
            row = row_of(samples, k, cells if is_now else None)
            values = self._at(row, wanted, moment if is_now else None, k, measured)
            for name, value in values.items():
                measured.values[name][k] = np.nan if value is None else value
            self.latest |= values
        return measured

    def _at(
        self,
        row: Row,
        wanted: Mapping[str, Metric],
        moment: Moment | None,
        k: int,
        measured: MetricValues,
    ) -> Values:
        values: Values = {}
        if builtins := {name: self._builtins[name] for name in wanted if name in self._builtins}:
            sample = self._make.sample(row)
            values = {name: measure(sample, moment) for name, measure in builtins.items()}
        if self._functions is not None:
            names = [name for name, metric in wanted.items() if metric.function is not None]
            values |= self._functions.measure(row, names)
        if moment is not None:
            for name in self._variables:
                if name in wanted:
                    of_robots = self._variables[name].read(moment.engine.state)
                    values[name] = self._variables[name].reduced(of_robots)
                    if name in measured.of_robots:
                        measured.of_robots[name][k] = of_robots
        for name, metric in wanted.items():
            if metric.builtin == "first_time":
                values[name] = self._first_time(name, metric, values, seconds(row.tick))
        return values

    def _first_time(self, name: str, metric: Metric, values: Values, time_s: float) -> float | None:
        assert metric.metric is not None
        value = values.get(metric.metric)
        if name not in self._reached and value is not None:
            least, most = metric.at_least, metric.at_most
            if (least is not None and value >= least) or (most is not None and value <= most):
                self._reached[name] = time_s
        return self._reached.get(name)


def metrics_summary(keys: ExperimentSchema, latest: Values) -> dict[str, dict[str, object]]:
    """Metrics in the --json object: value, unit and meaning, by name."""
    return {
        name: {
            "value": latest.get(name),
            "unit": metric.shown_unit,
            "meaning": metric.shown_meaning,
        }
        for name, metric in keys.metric.items()
    }
