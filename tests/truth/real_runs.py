"""Compares a run of collective perception with the real runs of docs/collective_perception.md.

The project carries the figures of real runs, `real_runs.json`, and not their logs. Who has logs can
compare with these instead, or make the figures anew:

    python -m tests.truth.real_runs FIGURES.json SOURCE LOG...

Bounds come from how real runs differ from one another: one more run like them lies within with a
probability of 95 %, in each measure (the prediction interval of a normal distribution). Some
measures of a real run lie outside of what the other real runs say; a run is like real ones if no
more of its measures do, and none farther, than of the one among them that differs most.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path
from statistics import fmean, median, stdev
from typing import Any

from tests.truth.collective_log import (
    GAPS,
    LAGS,
    LONG_GAP,
    WINDOWS,
    Log,
    Measures,
    measure,
    read,
)

from kilotwin.errors import InputError
from kilotwin.table.grid.kilodat import UNIT_S

FIGURES = Path(__file__).with_name("real_runs.json")
LEAST_RUNS = 3
"""So few logs show how they differ."""

_LEAST_KNOWN = 2
Figures = Mapping[str, float | None]
"""Measures by name; None: it never came to that."""

# Student's t for 97.5 % by degrees of freedom; beyond the last one the normal distribution's.
_T = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160]
_T += [2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086]
_T_BEYOND = 1.96

_LABELS = {
    "rate": "records per robot and s",
    **{f"rate {a}-{b}": f"  {a} to {b} s after the start" for a, b in WINDOWS},
    "twice": "received by two cells, share",
    **{f"gap {gap}": f"gaps of {gap} s, share" for gap in GAPS},
    "long gaps": f"gaps of {LONG_GAP} s and more, per robot and hour",
    "long gap": "  their mean, s",
    "longest gap": "  the longest, s",
    "dissemination": "records in DISSEMINATION, share",
    "wall": "records in wall avoidance, share",
    **{f"displacement {lag}": f"displacement, lag {lag} s, cm" for lag in LAGS},
    "spread": "robots' displacement, lag 10 s: sd over mean",
    "slowest": "  of the slowest robot, cm",
    "changes": "changes of opinion, per robot and hour",
    "largest at 10": "largest opinion, 10 % through the run",
    "largest at 50": "  50 %",
    "largest at 100": "  100 %",
    "agreed": "80 % of one opinion after, min",
}
# Arena and rule of a real run are not known, and a run may be of another length.
_SHOWN_ONLY = {"changes", "largest at 10", "largest at 50", "largest at 100", "agreed"}


@dataclass(frozen=True)
class LogRow:
    """A measure of the run, and the real runs' median and bounds."""

    name: str
    value: float
    real: float
    middle: float
    half: float

    @property
    def low(self) -> float:
        """The lower bound; no measure is below 0."""
        return max(self.middle - self.half, 0.0)

    @property
    def high(self) -> float:
        """The upper bound."""
        return self.middle + self.half

    @property
    def distance(self) -> float:
        """From the middle, where the bounds are 1 away."""
        off = abs(self.value - self.middle)
        return off / self.half if self.half else (inf if off else 0.0)

    @property
    def judged(self) -> bool:
        """Whether the bounds decide anything."""
        return self.name not in _SHOWN_ONLY

    @property
    def within(self) -> bool:
        """Whether a real run could have this value."""
        return self.low <= self.value <= self.high

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        return {
            "measure": self.name,
            "run": _finite(self.value),
            "real": _finite(self.real),
            "low": self.low,
            "high": _finite(self.high),
            "judged": self.judged,
            "within": self.within,
            "distance": _finite(self.distance),
        }


@dataclass(frozen=True)
class LogComparison:
    """One run against some real ones."""

    log: Log
    source: str
    runs: int
    rows: tuple[LogRow, ...]
    may_be_outside: int
    """Measures of the real run that differs most from the other ones."""
    may_be_away: float
    """The farthest measure of a real run, where the bounds are 1 away."""

    @property
    def within_bounds(self) -> bool:
        """No more rows outside, and none farther, than of a real run."""
        return outside(self.rows) <= self.may_be_outside and farthest(self.rows) <= self.may_be_away

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        return {
            "run": self.log.source,
            "robots": self.log.robots,
            "records": len(self.log.second),
            "log_seconds": self.log.seconds,
            "real_runs": self.runs,
            "real_source": self.source,
            "rows": [row.as_dict() for row in self.rows],
            "may_be_outside": self.may_be_outside,
            "may_be_away": self.may_be_away,
            "within_bounds": self.within_bounds,
        }


def compare(run: Path, logs: Sequence[Path]) -> LogComparison:
    """With real logs, at least three, or without any with the figures that the project carries."""
    if 0 < len(logs) < LEAST_RUNS:
        what = f"{len(logs)} logs do not show how real runs differ"
        raise InputError(f"{what}; name {LEAST_RUNS} or more, or none for the figures we carry")
    log = read(run)
    if logs:
        real: list[Figures] = [measure(read(file)) for file in logs]
        source = f"{len(logs)} logs"
    else:
        carried = json.loads(FIGURES.read_text())
        real, source = list(carried["runs"].values()), carried["source"]
    each = [rows_of(one, [*real[:number], *real[number + 1 :]]) for number, one in enumerate(real)]
    return LogComparison(
        log,
        source,
        len(real),
        rows_of(measure(log), real),
        max(map(outside, each)),
        max(map(farthest, each)),
    )


def rows_of(found: Figures, real: Sequence[Figures]) -> tuple[LogRow, ...]:
    """The measures of one run against those of at least two others."""
    return tuple(_row(name, found[name], [one[name] for one in real]) for name in _LABELS)


def outside(rows: Sequence[LogRow]) -> int:
    """How many of the rows that are judged are outside of their bounds."""
    return sum(row.judged and not row.within for row in rows)


def farthest(rows: Sequence[LogRow]) -> float:
    """How far the farthest of the rows that are judged is, where the bounds are 1 away."""
    return max(row.distance for row in rows if row.judged)


def _row(name: str, value: float | None, real: Sequence[float | None]) -> LogRow:
    """The prediction interval around the mean; the median is what the tables of docs show."""
    known = [one for one in real if one is not None and isfinite(one)]
    value = inf if value is None else value
    if len(known) < _LEAST_KNOWN:
        return LogRow(name, value, median(known) if known else inf, 0.0, inf)
    freedom = len(known) - 1
    t = _T[freedom - 1] if freedom <= len(_T) else _T_BEYOND
    half = t * stdev(known) * (1 + 1 / len(known)) ** 0.5
    return LogRow(name, value, median(known), fmean(known), half)


def report_text(comparison: LogComparison) -> str:
    """A table: the run, the real runs' median, the bounds."""
    lines = [f"{'':48}{'run':>8}{'real':>8}{'off':>8}   one more real run"]
    for row in comparison.rows:
        bounds = f"{_number(row.low)} to {_number(row.high)}"
        verdict = ("" if row.within else "OUTSIDE") if row.judged else "not judged"
        known = row.real and isfinite(row.real) and isfinite(row.value)
        off = f"{100 * (row.value / row.real - 1):+.0f} %" if known else ""
        left = f"{_LABELS[row.name]:48}{_number(row.value):>8}{_number(row.real):>8}{off:>8}"
        lines.append(f"{left}   {bounds:18} {verdict}".rstrip())
    judged = [row for row in comparison.rows if row.judged]
    inside = sum(row.within for row in judged)
    log = comparison.log
    return "\n".join(
        [
            *lines,
            "",
            f"{len(log.second):,} records of {log.robots} robots in {log.seconds:,} s. Seconds are "
            f"log seconds of {UNIT_S:.4f} s.",
            f"Real: {comparison.runs} runs; one more of them lies within the bounds with 95 %.",
            f"Source: {comparison.source}.",
            f"{inside} of {len(judged)} within bounds, the farthest at "
            f"{farthest(comparison.rows):.1f} times its bounds; of real runs at worst "
            f"{len(judged) - comparison.may_be_outside} and {comparison.may_be_away:.1f}",
            "like real runs" if comparison.within_bounds else "NOT like real runs",
        ]
    )


def _finite(value: float) -> float | None:
    """For JSON, which has no infinity."""
    return value if isfinite(value) else None


def _number(value: float) -> str:
    if value == inf:
        return "never"
    return f"{value:.3f}" if value < 1 else f"{value:.2f}" if value < 10 else f"{value:.1f}"


def figures(source: str, logs: Sequence[Path]) -> dict[str, Any]:
    """Contents of real_runs.json: the measures of each log, five digits."""
    runs: dict[str, Figures] = {}
    for file in logs:
        found: Measures = measure(read(file))
        name = file.name.removesuffix(".xz").removesuffix(".kilodat")
        runs[name] = {
            each: float(f"{value:.5g}") if isfinite(value) else None
            for each, value in found.items()
        }
    return {"source": source, "runs": runs}


if __name__ == "__main__":
    target, source_, *logs_ = sys.argv[1:]
    made = figures(source_, list(map(Path, logs_)))
    Path(target).write_text(json.dumps(made, indent=1) + "\n")
