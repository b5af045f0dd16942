"""Values with 95 % intervals of anything that can be resampled; SciPy does it."""

from collections.abc import Callable, Sequence
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kilotwin.studies.compare.plain_intervals import Interval

_SEED = 1  # the same table every time

Statistic = Callable[..., Any]
"""A figure of groups of values: arrays, along `axis`; their other axes are resamples."""


def _stats() -> Any:
    """SciPy's, which is large: figures of a run do without."""
    from scipy import stats

    return stats


def bootstrap(
    groups: Sequence[Sequence[float]], statistic: Statistic, resamples: int = 5000
) -> Interval:
    """A statistic and its 95 % interval (percentiles); every group is resampled by itself.

    Where each group is one value there is no interval.
    """
    arrays: list[NDArray[np.float64]] = [np.asarray(group, dtype=np.float64) for group in groups]
    value = float(statistic(*arrays, axis=-1))
    if max(map(len, arrays)) == 1:
        return Interval(value, nan, nan)
    # SciPy wants two values of a group at least; one that stands twice is the same when resampled.
    several = [np.repeat(array, 2) if len(array) == 1 else array for array in arrays]
    found = _stats().bootstrap(
        several,
        statistic,
        vectorized=True,
        n_resamples=resamples,
        method="percentile",
        rng=np.random.default_rng(_SEED),
    )
    return Interval(
        value, float(found.confidence_interval.low), float(found.confidence_interval.high)
    )


def bootstrap_mean(values: Sequence[float], resamples: int = 2000) -> Interval:
    """The mean and its 95 % interval."""
    return bootstrap([values], np.mean, resamples)


def mean_of_means(*groups: NDArray[np.float64], axis: int = -1) -> Any:
    """The mean of the groups' means, every group with equal weight."""
    return np.mean([group.mean(axis=axis) for group in groups], axis=0)


def mean_difference(*groups: NDArray[np.float64], axis: int = -1) -> Any:
    """Mean of the groups 0, 2, 4, ... less that of 1, 3, 5, ..., every group with equal weight."""
    return mean_of_means(*groups[0::2], axis=axis) - mean_of_means(*groups[1::2], axis=axis)


def spread(values: Sequence[float]) -> float:
    """The interquartile range, quartiles interpolated as numpy does."""
    return float(_stats().iqr(values))
