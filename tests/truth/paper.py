"""The paper's claims (a) to (e), each with our number, its 95 % interval and a verdict.

Sion, Reina, Birattari and Tuci (ANTS 2022): N robots, a share rho_I of them informed, a share
rho_sb of those for the first site. A claim that a sweep has not the trials for is left open.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from kilotwin.runs.reader import read_parquet
from kilotwin.studies.compare.bootstrap import (
    bootstrap,
    mean_difference,
    mean_of_means,
)
from kilotwin.studies.compare.plain_intervals import Interval, share_interval
from kilotwin.studies.sweep.conditions import Condition, Conditions, Ending, errors, on_site
from kilotwin.studies.sweep.data_set import SERIES

from .findings import OPEN, Finding, Findings, left_open, verdict

_WHOLE_S = 29_000  # trials of 30,000 s, less a sample
_SYMMETRIC_N = 100
_NOWHERE = (2, 6)  # claim (a): 4 +- 2
# One-sided 5 % critical value of Spearman's coefficient for the six shares of the paper.
_RISES = 0.8285
_NEAR = 0.1  # claim (b), "near the target": mean error up to this share of N
_FEW, _MANY = 0.3, 0.3
# Trials of a cell that an interquartile range wants: resampled from fewer it comes out too small,
# and its interval lies beside it.
_FEWEST = 5

# Claim (c): N, the condition on (rho_I, rho_sb), and what it is called.
Region = tuple[str, int, Callable[[float, float], bool]]
_NEARER: tuple[Region, ...] = (
    ("rho_I > 0.3, rho_sb > 0.8", 50, lambda informed, black: informed > 0.3 and black > 0.8),
    ("rho_I > 0.3, rho_sb > 0.8", 100, lambda informed, black: informed > 0.3 and black > 0.8),
    ("rho_I < 0.3, rho_sb < 0.7", 100, lambda informed, black: informed < 0.3 and black < 0.7),
)


def spread_difference(*groups: NDArray[np.float64], axis: int = -1) -> Any:
    """As mean_difference(), of interquartile ranges."""
    spreads = [stats.iqr(group, axis=axis) for group in groups]
    return np.mean(spreads[0::2], axis=0) - np.mean(spreads[1::2], axis=0)


def rank_correlation(x: Sequence[float], y: Sequence[float]) -> float:
    """Spearman's, equal values sharing their mean rank; 0 if one of the two does not vary."""
    if len(set(x)) < 2 or len(set(y)) < 2:
        return 0.0
    return float(stats.spearmanr(x, y).statistic)


def check(
    folder: Path, where: Sequence[str] = (), note: Callable[[str], None] = lambda _: None
) -> dict[str, Findings]:
    """All findings on the trials of a sweep, by reading. `where`: as for Conditions.open().

    `note` gets a line where trials of the sweep are lacking.
    """
    readings = Conditions.by_reading(folder, where)
    for progress in {trials.progress for trials in readings.values()} - {""}:
        note(f"{folder}: {progress}")
    shortest_s = _shortest_s(folder)
    if shortest_s < _WHOLE_S:
        note(
            f"{folder}: trials of {shortest_s:,.0f} s decide nothing; the claims are about 30,000 s"
        )
    return {
        reading: [
            finding if shortest_s >= _WHOLE_S else replace(finding, verdict=OPEN)
            for finding in (*_a(trials), *_b(trials), *_c(trials), *_d(trials), *_e(trials))
        ]
        for reading, trials in readings.items()
    }


def _shortest_s(folder: Path) -> float:
    """When the first of the trials to end ended; infinite of a data set without their series."""
    if not (folder / SERIES).is_file():
        return inf
    series = read_parquet(folder / SERIES)
    ends = series.select(["trial", "time_s"]).group_by("trial").aggregate([("time_s", "max")])
    return min(ends["time_s_max"].to_pylist(), default=inf)


def _a(trials: Conditions) -> list[Finding]:
    about = f"simplified, N = {_SYMMETRIC_N}, nobody informed"
    runs = _endings(trials.where(rule="simplified", robots=_SYMMETRIC_N, informed=0.0))
    if not runs:
        return [left_open("a", about)]
    one = sum(run.is_one_aggregate for run in runs)
    share = share_interval(one, len(runs))
    nowhere = [run.nowhere for run in runs]
    middle = bootstrap([nowhere], np.median)
    width = bootstrap([nowhere], stats.iqr)
    low, high = _NOWHERE
    if len(runs) == 1:
        number = f"resting nowhere {nowhere[0]}; one trial decides nothing"
        return [left_open("a", about, number)]
    return [
        Finding(
            "a",
            f"{about}: share of runs with one aggregate; lower bound above 0.5",
            f"{one} of {len(runs)}: {share}",
            verdict(share.low > 0.5),
        ),
        Finding(
            "a",
            f"{about}: resting nowhere, median {low} to {high} (paper 4; interquartile range 5)",
            f"median {middle}, interquartile range {width}",
            verdict(low <= middle.value <= high),
        ),
    ]


def _b(trials: Conditions) -> list[Finding]:
    findings = []
    for rule in ("simplified", "firat"):
        for robots in (50, 100):
            about = f"{rule}, N = {robots}"
            informed = _informed(trials, rule=rule, robots=robots)
            rows = _rows(informed)
            if not rows:
                findings.append(left_open("b", about))
                continue
            trends = [_trends(row) for row in rows.values()]
            worst_up, worst_down = min(t[0] for t in trends), max(t[1] for t in trends)
            findings.append(
                Finding(
                    "b",
                    f"{about}: rank correlation of medians with rho_sb, least over rho_I; black "
                    f"at least {_RISES:.2f}, white at most -{_RISES:.2f}",
                    f"black {worst_up:.2f}, white {worst_down:.2f}",
                    verdict(worst_up >= _RISES and worst_down <= -_RISES),
                )
            )
            steered = {c: runs for c, runs in informed.items() if c.informed >= _MANY}
            findings.append(_near(about, robots, steered))
    return findings


def _near(about: str, robots: int, cells: dict[Condition, list[Ending]]) -> Finding:
    about = f"{about}: mean error where rho_I >= {_MANY}; at most {_NEAR:.0%} of N"
    if not cells:
        return left_open("b", about)
    groups = [errors(condition, runs) for condition, runs in cells.items()]
    error = bootstrap(groups, mean_of_means, 1000)
    return Finding("b", about, f"{error} robots", verdict(error.value <= _NEAR * robots))


def _rows(cells: dict[Condition, list[Ending]]) -> dict[float, dict[Condition, list[Ending]]]:
    """The conditions by rho_I; only rows of at least three shares can show a trend."""
    rows: dict[float, dict[Condition, list[Ending]]] = {}
    for condition, runs in cells.items():
        rows.setdefault(condition.informed, {})[condition] = runs
    return {informed: row for informed, row in rows.items() if len(row) >= 3}


def _trends(row: dict[Condition, list[Ending]]) -> tuple[float, float]:
    shares = [condition.shares[0] for condition in row]
    black, white = (
        rank_correlation(shares, [median(on_site(runs, site)) for runs in row.values()])
        for site in (0, 1)
    )
    return black, white


def _c(trials: Conditions) -> list[Finding]:
    findings = []
    for name, robots, inside in _NEARER:
        about = f"N = {robots}, {name}: error of Firat less that of simplified, above 0"
        pairs = _pairs(trials, robots, inside)
        if not pairs:
            findings.append(left_open("c", about))
            continue
        groups = [errors(condition, runs) for pair in pairs for condition, runs in pair]
        nearer_by = bootstrap(groups, mean_difference)
        if nearer_by.is_known:
            found = Finding("c", about, f"{nearer_by} robots", verdict(nearer_by.low > 0))
        else:
            found = left_open("c", about, f"{nearer_by} robots; one trial a cell gives no interval")
        findings.append(found)
    return findings


def _d(trials: Conditions) -> list[Finding]:
    few = "rho_I < 0.3: simplified varies more, interval above 0"
    many = "rho_I >= 0.3: about equal, interval holds 0"
    return [
        _wider(trials, few, lambda informed, _: informed < _FEW, lambda wider: wider.low > 0),
        _wider(
            trials,
            many,
            lambda informed, _: informed >= _MANY,
            lambda wider: wider.low <= 0 <= wider.high,
        ),
    ]


def _wider(
    trials: Conditions,
    about: str,
    inside: Callable[[float, float], bool],
    holds: Callable[[Interval], bool],
) -> Finding:
    """The interquartile range of simplified less that of Firat, over all cells and both sites.

    Cells of few trials are left out.
    """
    about = f"interquartile range of simplified less that of Firat, {about}"
    pairs = [pair for robots in (50, 100) for pair in _pairs(trials, robots, inside)]
    if not pairs:
        return left_open("d", about)
    pairs = [pair for pair in pairs if all(len(runs) >= _FEWEST for _, runs in pair)]
    if not pairs:
        return left_open("d", about, f"fewer than {_FEWEST} trials in each cell")
    groups = [on_site(runs, site) for pair in pairs for site in (0, 1) for _, runs in pair[::-1]]
    wider = bootstrap(groups, spread_difference, 1000)
    return Finding("d", about, f"{wider} robots", verdict(holds(wider)))


def _e(trials: Conditions) -> list[Finding]:
    about = "Firat, nobody informed: most robots resting in any run, 0"
    runs = _endings(trials.where(rule="firat", informed=0.0))
    if not runs:
        return [left_open("e", about)]
    most = max(sum(run.resting) for run in runs)
    return [Finding("e", about, f"{most} in {len(runs)} runs", verdict(most == 0))]


def _informed(trials: Conditions, **wanted: Any) -> dict[Condition, list[Ending]]:
    cells = trials.where(**wanted)
    return {c: runs for c, runs in cells.items() if c.informed > 0 and len(c.shares) == 2}


def _endings(cells: dict[Condition, list[Ending]]) -> list[Ending]:
    return [run for runs in cells.values() for run in runs]


def _pairs(
    trials: Conditions, robots: int, inside: Callable[[float, float], bool]
) -> list[tuple[tuple[Condition, list[Ending]], tuple[Condition, list[Ending]]]]:
    """Trials of each cell in the region: Firat's, and those of simplified."""
    firat = _informed(trials, rule="firat", robots=robots)
    simplified = _informed(trials, rule="simplified", robots=robots)
    pairs = []
    for condition, runs in firat.items():
        other = Condition("simplified", robots, condition.informed, condition.shares)
        if other in simplified and inside(condition.informed, condition.shares[0]):
            pairs.append(((condition, runs), (other, simplified[other])))
    return pairs
