"""Assertions on samples: they fail where the sample contradicts the bound, and not before."""

import pytest

from kilotwin.testing import assert_share, assert_within


def test_a_share_fails_when_its_whole_interval_is_outside() -> None:
    assert_share(16, 20, at_least=0.9)
    assert_share([True] * 8 + [False] * 2, at_least=0.9)
    with pytest.raises(AssertionError, match=r"5 of 20, a share of 0.25 \[0.09, 0.49\].*below 0.8"):
        assert_share(5, 20, at_least=0.8)
    with pytest.raises(AssertionError, match=r"which is above 0\.1"):
        assert_share([1] * 10 + [0] * 10, at_most=0.1)


def test_more_trials_contradict_what_fewer_do_not() -> None:
    assert_share(7, 10, at_least=0.8)
    with pytest.raises(AssertionError):
        assert_share(70, 100, at_least=0.8)


def test_a_mean_fails_when_its_whole_interval_is_outside() -> None:
    assert_within([1, 2, 3], 2.5, 4)
    assert_within([3], 3, 3)
    with pytest.raises(AssertionError, match=r"6 values with a mean of 1.83 .* which is below 3"):
        assert_within([1, 2, 3, 2, 1, 2], 3, 4)
    with pytest.raises(AssertionError, match="1 value with a mean of 5, which is above 4"):
        assert_within([5], 3, 4)


@pytest.mark.parametrize("hits", [[], 3])
def test_no_trials_are_no_share(hits: object) -> None:
    with pytest.raises(ValueError, match="give hits and trials"):
        assert_share(hits)  # type: ignore[arg-type]


def test_bounds_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="the least and the most"):
        assert_within([1.0], 2, 1)
