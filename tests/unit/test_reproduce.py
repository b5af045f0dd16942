"""The numbers and verdicts of experiments/paper/reproduce.py."""

import importlib.util
import json
import sys
from math import comb
from pathlib import Path
from types import ModuleType

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "experiments/paper/reproduce.py"


def load() -> ModuleType:
    """The script as a module; it is no part of a package."""
    spec = importlib.util.spec_from_file_location("reproduce", SCRIPT)
    assert spec
    assert spec.loader
    module = sys.modules["reproduce"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


reproduce = load()


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
    share = reproduce.share_interval(hits, trials)
    assert (share.low, share.high) == pytest.approx((low, high), abs=1e-4)
    assert share.value == hits / trials


@pytest.mark.parametrize("hits", range(1, 50))
def test_at_the_ends_of_the_interval_each_tail_holds_a_fortieth(hits: int) -> None:
    share = reproduce.share_interval(hits, 50)

    def chance(p: float, counts: range) -> float:
        return sum(comb(50, k) * p**k * (1 - p) ** (50 - k) for k in counts)

    assert chance(share.low, range(hits, 51)) == pytest.approx(0.025)
    assert chance(share.high, range(hits + 1)) == pytest.approx(0.025)


@pytest.mark.parametrize(
    ("black", "white", "one"),
    [
        (90, 10, True),
        (89, 10, False),
        (9, 81, True),
        (9, 80, False),
        (50, 50, False),
        (1, 0, True),
        (0, 0, False),
    ],
)
def test_one_aggregate_is_nine_tenths_of_the_resting(black: int, white: int, one: bool) -> None:
    assert reproduce.is_one_aggregate(black, white) is one


@pytest.mark.parametrize(
    ("low", "nowhere", "verdict"),
    [
        (0.51, 2, "holds"),
        (0.51, 6, "holds"),
        (0.5, 4, "missed: lower bound 0.50 is not above 0.5"),
        (0.8, 6.5, "missed: median 6.5 is not within 2 to 6"),
        (0.8, 1.5, "missed: median 1.5 is not within 2 to 6"),
        (0.3, 9, "missed: lower bound 0.30 is not above 0.5, median 9 is not within 2 to 6"),
    ],
)
def test_claim_a_needs_both_and_a_miss_has_its_size(
    low: float, nowhere: float, verdict: str
) -> None:
    assert reproduce.verdict_a(reproduce.Interval(0.9, low, 1.0), nowhere) == verdict


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (0.1, 2.0, "simplified nearer"),
        (-2.0, -0.1, "Firat nearer"),
        (-0.1, 2.0, "undecided"),
        (0.0, 2.0, "undecided"),
    ],
)
def test_claim_c_is_decided_only_without_0_in_the_interval(
    low: float, high: float, verdict: str
) -> None:
    assert reproduce.verdict_c(reproduce.Interval((low + high) / 2, low, high)) == verdict


def test_the_interquartile_range_is_numpys() -> None:
    assert reproduce.spread([1, 2, 3, 4]) == 1.5
    assert reproduce.spread([5, 1, 4, 2, 3]) == 2
    assert reproduce.spread([7]) == 0


def test_the_bootstrap_finds_a_difference_and_none() -> None:
    near, far = [1.0, 2.0, 3.0, 2.0] * 3, [6.0, 7.0, 8.0, 7.0] * 3
    clear = reproduce.bootstrap([far, near], reproduce.mean_difference)
    assert clear.value == 5
    assert 4 < clear.low < 5 < clear.high < 6
    none = reproduce.bootstrap([far, near, near, far], reproduce.mean_difference)
    assert none.value == 0
    assert none.low < 0 < none.high


def test_the_bootstrap_gives_the_same_interval_every_time() -> None:
    groups = [[1.0, 5.0, 2.0], [4.0, 4.0, 9.0]]
    once = reproduce.bootstrap(groups, reproduce.mean_difference)
    assert reproduce.bootstrap(groups, reproduce.mean_difference) == once


def test_an_interval_is_written_after_its_value() -> None:
    assert str(reproduce.Interval(0.5, 0.3553, 0.6447)) == "0.5 [0.36, 0.64]"
    assert str(reproduce.Interval(3, 2.0, 4.5)) == "3 [2, 4.5]"


def test_the_error_counts_both_sites() -> None:
    result = reproduce.Result(60, 30, 10, 0, 0.0, "")
    assert result.error(70) == (10 + 0) / 2
    assert result.error(50) == (10 + 20) / 2


def test_shares_of_the_informed_sum_to_1_on_the_command_line(tmp_path: Path) -> None:
    command = reproduce.Condition("firat", 50, 0.4, 0.9).command(7, tmp_path)
    assert "swarm.informed_for.white=0.1" in command
    assert command[command.index("--seed") + 1] == "7"
    alone = reproduce.Condition("simplified", 100).command(1, tmp_path)
    assert not any("informed_for" in word for word in alone)


def test_a_run_is_finished_only_when_its_result_is_there(tmp_path: Path) -> None:
    stem = tmp_path / "firat-n50-0-s1"
    stem.mkdir()
    engine = {"version": "0.1.0", "build": "gcc", "box2d": "3.1.1"}
    (stem / "manifest.json").write_text(json.dumps({"engine": engine}))
    assert reproduce.finished(stem) is None
    summary = {
        "resting": {"black": 3, "white": 2},
        "not_resting": 45,
        "stats": {"contacts": 0},
        "cpu_s": 1.5,
    }
    (tmp_path / "firat-n50-0-s1.json").write_text(json.dumps(summary))
    made_by = "kilotwin 0.1.0 (gcc), Box2D 3.1.1"
    assert reproduce.finished(stem) == reproduce.Result(3, 2, 45, 0, 1.5, made_by)
