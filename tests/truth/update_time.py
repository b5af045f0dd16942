"""The claims (i) to (v) of the paper on the update time, each with our number, its 95 % interval
and a verdict, in each of the worlds that a sweep has (docs/update_time.md).

Sion and Tuci (SAB 2022, LNAI 13499). A claim that a sweep has not the trials for is left open.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kilotwin.errors import InputError
from kilotwin.runs.reader import read_parquet
from kilotwin.studies.compare.bootstrap import bootstrap, mean_difference
from kilotwin.studies.compare.plain_intervals import share_interval
from kilotwin.studies.sweep.conditions import Row, chosen
from kilotwin.studies.sweep.data_set import SERIES, TRIALS

from .findings import Finding, Findings, left_open, verdict

SHORT, LONG, DYNAMIC = "2 s", "8 s", "dynamic"
TO_BLACK, EVEN, NOBODY = (16, 0), (8, 8), (0, 0)
"""Robots informed for black and for white."""

_END_S = 17_900  # of five hours, less a sample
_HOUR_S = 3_600
_ONE_SITE = 0.9  # of the robots on stripes: the symmetry is broken

_NAME, _FOR_BLACK, _FOR_WHITE = "name", "robots.1.count", "robots.2.count"
_BLACK, _WHITE = "metric_black", "metric_white"


@dataclass(frozen=True)
class Course:
    """One run: time_s, and robots whose last cell was black and white, [samples] each."""

    time_s: NDArray[np.float64]
    black: NDArray[np.float64]
    white: NDArray[np.float64]
    robots: int

    @property
    def outside(self) -> float:
        """Robots on neither stripe in the end."""
        return float(self.robots - self.black[-1] - self.white[-1])

    @property
    def mean_white(self) -> float:
        """Robots on white, the mean over the run: less where white empties sooner."""
        return float(self.white.mean())

    @property
    def share(self) -> NDArray[np.float64]:
        """[samples]: black's share of the robots on stripes; a half where there are none."""
        on_stripes = self.black + self.white
        shares = np.full(len(on_stripes), 0.5)
        np.divide(self.black, on_stripes, out=shares, where=on_stripes > 0)
        return shares

    @property
    def swing(self) -> float:
        """The standard deviation of black's share after the first hour."""
        return float(self.share[self.time_s >= _HOUR_S].std())

    @property
    def broke_symmetry(self) -> bool:
        """Whether nine tenths of the robots on stripes are on one of them in the end."""
        return abs(float(self.share[-1]) - 0.5) >= _ONE_SITE - 0.5


@dataclass(frozen=True)
class Figure:
    """A number of a run, and its name in the table."""

    name: str
    of: Callable[[Course], float]


OUTSIDE = Figure("robots outside in the end, all conditions", lambda run: run.outside)
WHITE = Figure("16 informed for black: robots on white over the run", lambda run: run.mean_white)
SWING = Figure("8 and 8 informed: swing of black's share after an hour", lambda run: run.swing)

Cells = dict[tuple[tuple[int, int], str], list[Course]]
"""Runs by informed robots and update time."""


def check(
    folder: Path, where: Sequence[str] = (), note: Callable[[str], None] = lambda _: None
) -> dict[str, Findings]:
    """All findings on the trials of a sweep, by world: the name of the experiment that it varied.

    `where`: texts such as name="2 s", all of which a trial has to meet. `note` gets a line where
    trials are too short to decide.
    """
    found: dict[str, Findings] = {}
    for world, cells in _worlds(folder, where).items():
        ends_s = [run.time_s[-1] for runs in cells.values() for run in runs]
        if min(ends_s) < _END_S:
            note(f"{folder}: trials of {min(ends_s):,.0f} s decide nothing; claims are on 5 hours")
            found[world] = [left_open(claim, "trials are too short") for claim in _CLAIMS]
        else:
            found[world] = [finding for claim in _CLAIMS.values() for finding in claim(cells)]
    return found


def courses(folder: Path, where: Sequence[str] = ()) -> Iterator[tuple[Row, Course]]:
    """The finished trials of a sweep of experiments/kilogrid/update-time: each one's row of the
    data set, and its course. InputError of anything else."""
    try:
        trials, series = read_parquet(folder / TRIALS), read_parquet(folder / SERIES)
    except FileNotFoundError:
        raise InputError(
            f"{folder}: no sweep with finished trials; type: kilotwin sweep "
            "experiments/kilogrid/update-time/claims.toml"
        ) from None
    columns = {*trials.column_names, *series.column_names}
    for column in ("base", _NAME, _FOR_BLACK, _FOR_WHITE, "robots", _BLACK, _WHITE):
        if column not in columns:
            raise InputError(
                f"{folder}: no column {column}; name a sweep of experiments/kilogrid/update-time"
            )
    numbers = series["trial"].to_numpy()  # ascending: the trials one after the other
    values = {name: series[name].to_numpy() for name in ("time_s", _BLACK, _WHITE)}
    for row in chosen(folder, trials, where):
        own = slice(*np.searchsorted(numbers, (row["trial"], row["trial"] + 1)))
        time_s, black, white = (values[name][own] for name in ("time_s", _BLACK, _WHITE))
        yield row, Course(time_s, black, white, int(row["robots"]))


def _worlds(folder: Path, where: Sequence[str]) -> dict[str, Cells]:
    worlds: dict[str, Cells] = {}
    for row, run in courses(folder, where):
        cell = (row[_FOR_BLACK], row[_FOR_WHITE]), row[_NAME]
        worlds.setdefault(row["base"], {}).setdefault(cell, []).append(run)
    return worlds


def _longer_leaves_fewer_outside(cells: Cells) -> Findings:
    return [
        _less("i", cells, SHORT, LONG, OUTSIDE),
        _less("i", cells, LONG, DYNAMIC, OUTSIDE),
    ]


def _longer_slows_the_split(cells: Cells) -> Findings:
    return [_less("ii", _of(cells, TO_BLACK), LONG, SHORT, WHITE)]


def _dynamic_has_both(cells: Cells) -> Findings:
    return [
        _less("iii", cells, SHORT, DYNAMIC, OUTSIDE),
        _less("iii", _of(cells, TO_BLACK), LONG, DYNAMIC, WHITE),
    ]


def _short_swings(cells: Cells) -> Findings:
    return [_less("iv", _of(cells, EVEN), SHORT, LONG, SWING)]


def _symmetry_stays(cells: Cells) -> Findings:
    about = f"nobody informed, {SHORT}: share of runs with nine tenths on one stripe, below a half"
    runs = cells.get((NOBODY, SHORT), [])
    if not runs:
        return [left_open("v", about)]
    broke = sum(run.broke_symmetry for run in runs)
    share = share_interval(broke, len(runs))
    number = f"{broke} of {len(runs)}: {share}"
    if share.low <= 0.5 <= share.high:
        return [left_open("v", about, number)]
    return [Finding("v", about, number, verdict(share.high < 0.5))]


_CLAIMS: dict[str, Callable[[Cells], Findings]] = {
    "i": _longer_leaves_fewer_outside,
    "ii": _longer_slows_the_split,
    "iii": _dynamic_has_both,
    "iv": _short_swings,
    "v": _symmetry_stays,
}


def _of(cells: Cells, informed: tuple[int, int]) -> Cells:
    """Those with these informed robots."""
    return {cell: runs for cell, runs in cells.items() if cell[0] == informed}


def _less(claim: str, cells: Cells, more: str, less: str, figure: Figure) -> Finding:
    """A figure at the update time `more` less that at `less`, the mean over conditions: the claim
    holds if its interval is above 0."""
    groups: list[list[float]] = []
    for informed in dict.fromkeys(informed for informed, _ in cells):
        pair = [cells.get((informed, time), []) for time in (more, less)]
        if all(pair):
            groups += [[figure.of(run) for run in runs] for runs in pair]
    about = f"{figure.name}, {more} less {less}, above 0"
    if not groups:
        return left_open(claim, about)
    found = bootstrap(groups, mean_difference)
    if not found.is_known:
        return left_open(claim, about, f"{found}; one trial a cell gives no interval")
    return Finding(claim, about, str(found), verdict(found.low > 0))
