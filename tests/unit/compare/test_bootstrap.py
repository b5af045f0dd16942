"""Intervals of shares and of resampled statistics, and what they are made of."""

from math import comb

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.truth.paper import rank_correlation

from kilotwin.studies.compare.bootstrap import (
    bootstrap,
    bootstrap_mean,
    mean_difference,
    spread,
)
from kilotwin.studies.compare.plain_intervals import Interval, share_interval


@pytest.mark.parametrize(
    ("hits", "trials", "low", "high"),
    [  # as R's binom.test gives them
        (0, 10, 0.0, 0.3085),
        (10, 10, 0.6915, 1.0),
        (5, 10, 0.1871, 0.8129),
        (12, 20, 0.3605, 0.8088),
        (1, 1, 0.025, 1.0),
    ],
)
def test_the_interval_of_a_share_is_the_exact_one(
    hits: int, trials: int, low: float, high: float
) -> None:
    share = share_interval(hits, trials)
    assert (share.low, share.high) == pytest.approx((low, high), abs=1e-4)
    assert share.value == hits / trials


@pytest.mark.parametrize("hits", range(1, 50))
def test_at_the_ends_of_the_interval_each_tail_holds_a_fortieth(hits: int) -> None:
    share = share_interval(hits, 50)

    def chance(p: float, counts: range) -> float:
        return sum(comb(50, k) * p**k * (1 - p) ** (50 - k) for k in counts)

    assert chance(share.low, range(hits, 51)) == pytest.approx(0.025)
    assert chance(share.high, range(hits + 1)) == pytest.approx(0.025)


def test_the_interquartile_range_is_numpys() -> None:
    assert spread([1, 2, 3, 4]) == 1.5
    assert spread([5, 1, 4, 2, 3]) == 2
    assert spread([7]) == 0


def test_the_bootstrap_finds_a_difference_and_none() -> None:
    near, far = [1.0, 2.0, 3.0, 2.0] * 3, [6.0, 7.0, 8.0, 7.0] * 3
    clear = bootstrap([far, near], mean_difference)
    assert clear.value == 5
    assert 4 < clear.low < 5 < clear.high < 6
    none = bootstrap([far, near, near, far], mean_difference)
    assert none.value == 0
    assert none.low < 0 < none.high


def test_the_bootstrap_gives_the_same_interval_every_time() -> None:
    groups = [[1.0, 5.0, 2.0], [4.0, 4.0, 9.0]]
    once = bootstrap(groups, mean_difference)
    assert bootstrap(groups, mean_difference) == once


def test_an_interval_is_written_after_its_value() -> None:
    assert str(Interval(0.5, 0.3553, 0.6447)) == "0.5 [0.36, 0.64]"
    assert str(Interval(3, 2.0, 4.5)) == "3 [2, 4.5]"


def test_a_mean_lies_in_its_interval() -> None:
    mean = bootstrap_mean([1.0, 2.0, 3.0, 4.0] * 5)
    assert mean.value == 2.5
    assert 1.9 < mean.low < 2.5 < mean.high < 3.1


@pytest.mark.parametrize(
    ("y", "expected"),
    [
        ([1, 2, 3, 4], 1.0),
        ([9, 5, 2, 0], -1.0),
        ([1, 3, 2, 4], 0.8),
        ([7, 7, 7, 7], 0.0),
        ([1, 1, 2, 2], 0.8944),  # ties share their mean rank, as scipy's spearmanr has it
    ],
)
def test_a_rank_correlation_heeds_order_alone(y: list[float], expected: float) -> None:
    assert rank_correlation([0.5, 0.6, 0.7, 0.8], y) == pytest.approx(expected, abs=1e-4)


@given(st.lists(st.integers(-100, 100), min_size=2, max_size=12))
def test_a_rank_correlation_with_itself_is_1_unless_all_is_equal(values: list[int]) -> None:
    expected = 1.0 if len(set(values)) > 1 else 0.0
    assert rank_correlation(values, values) == pytest.approx(expected)
