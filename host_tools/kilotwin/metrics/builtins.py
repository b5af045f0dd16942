"""The built-in metrics. What each is called and takes is in `experiment/schema/metric.py`."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from kilotwin.experiment.areas import Area, area_of, inside
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.metric import Metric
from kilotwin.metrics import geometry
from kilotwin.metrics.moment import Moment
from kilotwin.metrics.sample import Sample

Points = NDArray[np.float64]
Measure = Callable[[Sample, Moment | None], float | None]
"""The value at a sample; None where it has none, as the spread of no robots."""

_ROWS = 1024  # of a table of distances that is in memory at a time


def builtin(metric: Metric, experiment: ExperimentSchema) -> Measure:
    """A function that measures it. It may keep what it has seen, so each run wants its own."""
    choose = _Choice(metric)
    of_points: dict[str, Callable[[Points], float | None]] = {
        "mean_distance": mean_distance,
        "spread": spread,
    }
    name = metric.builtin
    if name in ("hull_area", "clusters", "largest_cluster"):
        of_points[name] = _geometry(metric)
    if name in of_points:
        measured = of_points[name]
        return lambda sample, _: measured(choose.seen(sample))
    if name == "share":
        return lambda sample, _: float(choose.mask(sample).mean())
    if name == "number":
        return lambda sample, _: float(choose.mask(sample).sum())
    if name == "order":
        return lambda sample, _: order(sample.headings_rad[choose.mask(sample)])
    if name == "coverage":
        assert metric.cell_m is not None
        seen = Coverage(area_of(experiment.arena), metric.cell_m)
        return lambda sample, _: seen.with_points(choose.seen(sample))
    if name == "object_distance":
        goal, index = np.array(metric.goal_m), metric.object or 0
        return lambda sample, _: _object_distance(sample, index, goal)
    if name == "survival":
        return _survival
    return _Messages(rate=name == "message_rate")


def _geometry(metric: Metric) -> Callable[[Points], float]:
    if metric.builtin == "hull_area":
        return geometry.hull_area()
    assert metric.within_m is not None
    sizes = geometry.cluster_sizes(metric.within_m)
    if metric.builtin == "clusters":
        return lambda points: float(len(sizes(points)))
    return lambda points: float(max(sizes(points), default=0))


class _Choice:
    """The robots that a metric is about: those that meet all of state, site and region."""

    def __init__(self, metric: Metric) -> None:
        self._state, self._site = metric.state, metric.site
        self._region = None if metric.region is None else area_of(metric.region)

    def mask(self, sample: Sample) -> NDArray[np.bool_]:
        """Whether each robot is chosen."""
        chosen = np.ones(len(sample.leds), dtype=bool)
        if self._state is not None:
            chosen &= sample.states == self._state
        if self._site is not None:
            chosen &= sample.sites == self._site
        if self._region is not None:
            x, y = np.nan_to_num(sample.positions_m, nan=math.inf).T
            chosen &= inside(self._region, x, y)
        return chosen

    def seen(self, sample: Sample) -> Points:
        """Their places; without those of a real table that were not seen yet."""
        points: Points = sample.positions_m[self.mask(sample)]
        return points[np.isfinite(points).all(axis=1)]


def mean_distance(points: Points) -> float | None:
    """Mean over all pairs; N robots cost N * N / 2 distances."""
    number = len(points)
    if number < 2:
        return None
    total = 0.0
    for first in range(0, number, _ROWS):
        part = points[first : first + _ROWS]
        away = part[:, None, :] - points[None, :, :]
        total += float(np.sqrt((away**2).sum(axis=2)).sum())
    return total / (number * (number - 1))


def spread(points: Points) -> float | None:
    """Root mean square distance from the middle."""
    if not len(points):
        return None
    return float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))


def order(headings_rad: NDArray[np.float64]) -> float | None:
    """Length of the mean of the unit vectors."""
    known = headings_rad[np.isfinite(headings_rad)]
    if not len(known):
        return None
    return float(np.hypot(np.cos(known).mean(), np.sin(known).mean()))


class Coverage:
    """The squares of an arena in which a point has been."""

    def __init__(self, arena: Area, cell_m: float) -> None:
        """A square belongs to the arena if its middle does; there is one at least."""
        self._cell_m = cell_m
        self._corner = np.array([arena.x - arena.width / 2, arena.y - arena.height / 2])
        columns = max(1, math.ceil(arena.width / cell_m - 1e-9))
        rows = max(1, math.ceil(arena.height / cell_m - 1e-9))
        middles = (
            self._corner[0] + (np.arange(columns) + 0.5) * cell_m,
            self._corner[1] + (np.arange(rows) + 0.5) * cell_m,
        )
        x, y = np.meshgrid(*middles)
        self._whole = np.asarray(inside(arena, x, y))
        if not self._whole.any():
            self._whole[:] = True
        self._been = np.zeros_like(self._whole)

    def with_points(self, points: Points) -> float:
        """The share, after robots have been there."""
        place = np.floor((points - self._corner) / self._cell_m).astype(int)
        rows, columns = self._been.shape
        column = np.clip(place[:, 0], 0, columns - 1)
        row = np.clip(place[:, 1], 0, rows - 1)
        self._been[row, column] = True
        return float((self._been & self._whole).sum() / self._whole.sum())


def _object_distance(sample: Sample, index: int, goal: Points) -> float | None:
    if index >= len(sample.objects):
        return None
    return float(np.hypot(*(sample.objects[index, :2] - goal)))


def _survival(sample: Sample, moment: Moment | None) -> float | None:
    return None if moment is None else 1 - moment.failed / len(sample.leds)


class _Messages:
    """Messages that robots have sent: so far, or a second since the last sample."""

    def __init__(self, *, rate: bool) -> None:
        self._rate = rate
        self._before: tuple[float, int] | None = None

    def __call__(self, sample: Sample, moment: Moment | None) -> float | None:
        if moment is None:
            return None
        sent, robots = moment.messages_sent, len(sample.leds)
        if not self._rate:
            return sent / robots
        before, self._before = self._before, (sample.time_s, sent)
        if before is None or sample.time_s <= before[0]:
            return None
        return (sent - before[1]) / (sample.time_s - before[0]) / robots
