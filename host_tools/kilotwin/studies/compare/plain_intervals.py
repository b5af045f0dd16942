"""Values with 95 % intervals, of shares and means: without SciPy, which a plain install has not and
which takes half a second to load."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import exp, fsum, isnan, lgamma, log, nan

import numpy as np

_TAIL = 0.025
_BISECTIONS = 60
_RESAMPLES = 2000
_SEED = 1  # the same interval every time


@dataclass(frozen=True)
class Interval:
    """A value and its 95 % interval; NaN where single values gave none."""

    value: float
    low: float
    high: float

    @property
    def is_known(self) -> bool:
        """Whether there is an interval."""
        return not isnan(self.low)

    def __str__(self) -> str:
        if not self.is_known:
            return f"{round(self.value, 2):g}"
        return f"{round(self.value, 2):g} [{round(self.low, 2):g}, {round(self.high, 2):g}]"


def share_interval(hits: int, trials: int) -> Interval:
    """The exact (Clopper-Pearson) two-sided 95 % interval of a share. O(trials)."""
    low, high = 0.0, 1.0
    if hits > 0:  # with the share `low` so many hits or more come in a fortieth
        low = _root(lambda share: 1 - _at_most(hits - 1, trials, share) - _TAIL)
    if hits < trials:
        high = _root(lambda share: _TAIL - _at_most(hits, trials, share))
    return Interval(hits / trials, low, high)


def mean_interval(values: Sequence[float]) -> Interval:
    """The mean and its 95 % bootstrap interval (percentiles); none of a single value."""
    sample = np.asarray(values, dtype=np.float64)
    if len(sample) == 1:
        return Interval(float(sample[0]), nan, nan)
    drawn = np.random.default_rng(_SEED).choice(sample, (_RESAMPLES, len(sample)))
    low, high = np.quantile(drawn.mean(axis=1), [_TAIL, 1 - _TAIL])
    return Interval(float(sample.mean()), float(low), float(high))


def _at_most(hits: int, trials: int, share: float) -> float:
    """The probability of so many hits or fewer."""
    return fsum(
        exp(
            lgamma(trials + 1)
            - lgamma(k + 1)
            - lgamma(trials - k + 1)
            + k * log(share)
            + (trials - k) * log(1 - share)
        )
        for k in range(hits + 1)
    )


def _root(rising: Callable[[float], float]) -> float:
    """Where a function crosses 0 between 0 and 1."""
    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        if middle in (low, high):
            break
        low, high = (middle, high) if rising(middle) < 0 else (low, middle)
    return (low + high) / 2
