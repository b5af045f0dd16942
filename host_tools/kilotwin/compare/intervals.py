"""Values with 95 % intervals, of shares and of anything that can be resampled."""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import comb, isnan, nan
from statistics import fmean, quantiles

_SEARCH_STEPS = 60  # halvings of [0, 1]: as fine as a double
_TAIL = 0.025


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
    """The exact (Clopper-Pearson) two-sided 95 % interval of a share."""

    def lowest_share(count: int) -> float:
        """The share with which `count` or more of the trials hit in 2.5 % of the cases."""
        if count == 0:
            return 0.0
        low, high = 0.0, 1.0
        for _ in range(_SEARCH_STEPS):
            p = (low + high) / 2
            tail = sum(
                comb(trials, k) * p**k * (1 - p) ** (trials - k) for k in range(count, trials + 1)
            )
            low, high = (p, high) if tail < _TAIL else (low, p)
        return low

    return Interval(hits / trials, lowest_share(hits), 1 - lowest_share(trials - hits))


def bootstrap(
    groups: Sequence[Sequence[float]],
    statistic: Callable[[Sequence[Sequence[float]]], float],
    resamples: int = 5000,
) -> Interval:
    """A statistic and its 95 % interval (percentiles); every group is resampled by itself.

    Where each group is one value there is no interval.
    """
    if max(map(len, groups)) == 1:
        return Interval(statistic(groups), nan, nan)
    chance = random.Random(1)  # the same table every time
    values = sorted(
        statistic([chance.choices(group, k=len(group)) for group in groups])
        for _ in range(resamples)
    )
    return Interval(statistic(groups), values[resamples // 40], values[-resamples // 40])


def bootstrap_mean(values: Sequence[float], resamples: int = 2000) -> Interval:
    """The mean and its 95 % interval."""
    return bootstrap([values], lambda groups: fmean(groups[0]), resamples)


def mean_difference(groups: Sequence[Sequence[float]]) -> float:
    """Mean of the groups 0, 2, 4, ... less that of 1, 3, 5, ..., every group with equal weight."""
    means = [fmean(group) for group in groups]
    return fmean(means[0::2]) - fmean(means[1::2])


def spread(values: Sequence[float]) -> float:
    """The interquartile range, quartiles interpolated as numpy does."""
    if len(values) < 2:
        return 0.0
    first, _, third = quantiles(values, n=4, method="inclusive")
    return third - first


def rank_correlation(x: Sequence[float], y: Sequence[float]) -> float:
    """Spearman's, equal values sharing their mean rank; 0 if one of the two does not vary."""
    ranks_x, ranks_y = _ranks(x), _ranks(y)
    mean = (len(x) - 1) / 2
    both = sum((a - mean) * (b - mean) for a, b in zip(ranks_x, ranks_y, strict=True))
    alone = sum((a - mean) ** 2 for a in ranks_x) * sum((b - mean) ** 2 for b in ranks_y)
    return float(both / alone**0.5) if alone > 0 else 0.0


def _ranks(values: Sequence[float]) -> list[float]:
    ordered = sorted(values)
    return [ordered.index(value) + (ordered.count(value) - 1) / 2 for value in values]
