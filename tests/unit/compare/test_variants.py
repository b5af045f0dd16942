"""Two variants compared: what is told apart, what may be chance, and what decides nothing."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from kilotwin.errors import InputError
from kilotwin.studies.compare.sides import Side
from kilotwin.studies.compare.variants import APART, OPEN, SAME, bounds_of, compare, report_text

CHANCE = np.random.default_rng(3)


def side(name: str, trials: int = 20, end_s: float = 100.0, **values: list[float]) -> Side:
    return side_of(name, values, trials, end_s)


def side_of(
    name: str, values: dict[str, list[float]], trials: int = 20, end_s: float = 100.0
) -> Side:
    arrays = {metric: np.array(of) for metric, of in values.items()}
    return Side(name, arrays, dict.fromkeys(values, "m"), (end_s,) * trials)


def normal(mean: float, trials: int = 20) -> list[float]:
    return list(CHANCE.normal(mean, 1.0, trials))


def test_a_clear_difference_is_told_from_none() -> None:
    a = side("a", far=normal(0), same=normal(0))
    b = side("b", far=normal(3), same=normal(0))
    far, same = compare(a, b).differences
    assert far.difference.low < 3 < far.difference.high
    assert far.delta == pytest.approx(1, abs=0.15)
    assert far.p_corrected is not None
    assert far.p_corrected < 1e-4
    assert same.difference.low < 0 < same.difference.high
    assert same.p_corrected is not None
    assert same.p_corrected > 0.05


def test_the_interval_holds_the_true_difference_nine_times_in_ten_at_least() -> None:
    hits = 0
    for _ in range(100):
        a, b = side("a", m=normal(0)), side("b", m=normal(1))
        (one,) = compare(a, b).differences
        hits += one.difference.low <= 1 <= one.difference.high
    assert hits >= 88


def test_the_more_metrics_are_asked_the_less_a_single_one_says() -> None:
    many = {f"m{index}": normal(0) for index in range(20)}
    a, b = side_of("a", many), side_of("b", {name: normal(0) for name in many})
    alone = compare(a, b, ["m0"]).differences[0]
    among = next(one for one in compare(a, b).differences if one.metric == "m0")
    assert alone.p_corrected == alone.p == among.p
    assert among.p_corrected is not None
    assert among.p is not None
    assert among.p_corrected >= among.p
    false = [one for one in compare(a, b).differences if (one.p_corrected or 1) < 0.05]
    assert false == []


@pytest.mark.parametrize(
    ("bound", "verdict"), [("m=2", SAME), ("m=0.2", APART), ("m=1", OPEN), ("m=20%", SAME)]
)
def test_a_bound_is_kept_only_if_the_whole_interval_is_within(bound: str, verdict: str) -> None:
    rng = np.random.default_rng(1)
    a = side("a", m=list(rng.normal(10, 0.5, 40)), trials=40)
    b = side("b", m=list(rng.normal(11, 0.5, 40)), trials=40)
    compared = compare(a, b, (), bounds_of([bound]))
    assert compared.differences[0].verdict == verdict
    assert compared.within_bounds == (verdict == SAME)


@pytest.mark.parametrize(
    ("b", "why"),
    [
        (side("b", 1, m=[0.0]), "b: one trial decides nothing; 5 on each side"),
        (side("b", 3, m=[0.0] * 3), "b: 3 trials decide nothing"),
        (side("b", 20, 40.0, m=[0.0] * 20), "trials end at 40 to 100 s; those of different length"),
        (
            Side("b", {"m": np.zeros(20)}, {"m": "m"}, (100.0,) * 20, "the run is interrupted"),
            "b: the run is interrupted; runs that were cut short decide nothing",
        ),
    ],
)
def test_few_and_shortened_trials_decide_nothing(b: Side, why: str) -> None:
    compared = compare(side("a", m=[0.0] * 20), b, (), bounds_of(["m=10"]))
    assert compared.undecided.startswith(why)
    assert compared.differences[0].verdict == OPEN
    assert not compared.within_bounds
    assert f"undecided: {why}" in report_text(compared)


def test_what_one_side_lacks_is_named_and_left_out() -> None:
    a = Side("a", {"m": np.zeros(9), "x": np.zeros(9)}, {"m": "m", "x": "s"}, (1.0,) * 9)
    b = Side(
        "b",
        {"m": np.zeros(9), "x": np.zeros(9), "y": np.zeros(0)},
        {"m": "m", "x": "m", "y": ""},
        (1.0,) * 9,
    )
    compared = compare(a, b)
    assert [one.metric for one in compared.differences] == ["m"]
    assert compared.left_out == {"x": "it is in s in A, in m in B", "y": "a does not have it"}
    assert compared.differences[0].p == 1
    assert not any(
        math.isnan(v) for v in vars(compared.differences[0]).values() if isinstance(v, float)
    )


@pytest.mark.parametrize(
    ("metrics", "within", "said"),
    [
        (["z"], [], "--metric z: neither has it; they have m"),
        ([], ["z=1"], "--within z: neither has it"),
        ([], ["m"], "--within m: not of the form METRIC=2 or METRIC=10%"),
        ([], ["m=-1"], "--within m=-1: not of the form"),
        ([], ["m=1e"], "--within m=1e: not of the form"),
    ],
)
def test_what_cannot_be_asked_is_refused(metrics: list[str], within: list[str], said: str) -> None:
    a, b = side("a", m=[0.0] * 20), side("b", m=[0.0] * 20)
    with pytest.raises(InputError, match=re.escape(said)):
        compare(a, b, metrics, bounds_of(within))


def test_the_page_of_a_comparison_names_both(tmp_path: Path) -> None:
    text = report_text(compare(side("old", m=normal(0)), side("new", m=normal(0))))
    assert text.startswith("A: old, 20 trials of 100 s\nB: new, 20 trials of 100 s")
    assert "| m |" in text
