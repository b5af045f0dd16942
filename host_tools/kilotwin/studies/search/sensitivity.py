"""Which keys matter: SALib chooses points, trials of a sweep measure them."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from SALib.analyze import morris as morris_of
from SALib.analyze import sobol as sobol_of
from SALib.sample import morris as morris_points
from SALib.sample import sobol as sobol_points

from kilotwin.errors import InputError, RunError
from kilotwin.studies.search.points import Laboratory, mean_of
from kilotwin.studies.search.space import Axis

Method = Literal["morris", "sobol"]


@dataclass(frozen=True)
class Influence:
    """The effect of one key. Morris: `main` is mu*, the mean size of its effects over its range,
    and `more` their standard deviation, large if it depends on other keys. Sobol: shares of the
    variance, `main` by itself and `more` with all that others have to do with it. With half the
    width of their 95 % intervals; NaN where SALib gives none.
    """

    key: str
    main: float
    main_error: float
    more: float
    more_error: float


@dataclass(frozen=True)
class Sensitivity:
    """Influences of all keys on a metric, the largest first."""

    method: Method
    metric: str
    influences: list[Influence]
    points: int
    trials: int


def sensitivity(
    axes: list[Axis],
    metric: str,
    laboratory: Laboratory,
    *,
    method: Method,
    samples: int,
    repeats: int,
    seed: int = 1,
) -> Sensitivity:
    """Measures, or goes on. `samples`: trajectories of Morris, base points of Sobol."""
    if any(axis.choices for axis in axes):
        raise InputError("--over: choices have no order; give ranges, as KEY=1..4")
    if method == "sobol" and samples & (samples - 1):
        raise InputError(f"--samples {samples}: Sobol takes a power of 2; try {_power(samples)}")
    problem = {
        "num_vars": len(axes),
        "names": [axis.key for axis in axes],
        "bounds": [
            [math.log10(axis.low), math.log10(axis.high)] if axis.log else [axis.low, axis.high]
            for axis in axes
        ],
    }
    if method == "morris":
        chosen = morris_points.sample(problem, samples, seed=seed)
    else:
        chosen = sobol_points.sample(problem, samples, calc_second_order=False, seed=seed)
    points = [
        {
            axis.key: axis.value(10**number if axis.log else number)
            for axis, number in zip(axes, row, strict=True)
        }
        for row in chosen.tolist()
    ]
    measured = laboratory.measure(points, range(1, repeats + 1))
    values = np.array([mean_of(one, metric) for one in measured])
    if not np.isfinite(values).all():
        lacking = int((~np.isfinite(values)).sum())
        raise RunError(
            f"{lacking} of {len(points)} points have no value of {metric} at the end; the method "
            f"needs all of them: see metrics_failed and failed/ in {laboratory.folder}"
        )
    found = _analysed(problem, method, chosen, values, seed)
    found.sort(key=lambda one: -one.main)
    return Sensitivity(method, metric, found, len(points), laboratory.trials)


def _analysed(
    problem: dict[str, Any],
    method: Method,
    chosen: NDArray[np.float64],
    values: NDArray[np.float64],
    seed: int,
) -> list[Influence]:
    names = problem["names"]
    if method == "morris":
        of = morris_of.analyze(problem, chosen, values, seed=seed)
        parts = (of["mu_star"], of["mu_star_conf"], of["sigma"], [math.nan] * len(names))
    else:
        of = sobol_of.analyze(problem, values, calc_second_order=False, seed=seed)
        parts = (of["S1"], of["S1_conf"], of["ST"], of["ST_conf"])
    return [
        Influence(name, *(float(part[place]) for part in parts)) for place, name in enumerate(names)
    ]


def _power(samples: int) -> int:
    return int(2 ** round(math.log2(samples)))
