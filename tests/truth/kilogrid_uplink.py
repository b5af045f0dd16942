"""Compares how often cells receive robots with a real grid.

Four runs of 98 to 100 Kilobots on 1 x 2 m. Each robot tries to report every 2 s. The host logs
the answers of modules to its polls, in whole log seconds.

Real robots had other messages in their queue, which kept reports out of it for a time
(docs/collective_perception.md 1): how many reports there were, and their long gaps, are shown and
not judged.
"""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kilotwin.errors import InputError
from kilotwin.runs.reader import Run
from kilotwin.units import TICK_S

Floats = NDArray[np.float64]

_LOG_SECOND_S = 32 * TICK_S
# Two records of a robot so near to one another are one frame, received at two modules: the robot's
# next attempt comes 2 s later, and modules keep records for less than this before they are polled.
_SAME_FRAME_S = 1.0

# hardware.md 2.1.
_REAL_RATE = 0.20
_REAL_GAPS = {2: 0.37, 4: 0.17, 6: 0.074, 8: 0.031}
_GAPS_WITHIN = 0.25
_REAL_RATIO, _RATIO_WITHIN = 0.45, 0.07
_REAL_DOUBLES, _DOUBLES_WITHIN = 0.126, 0.04

_LEAST_S = 300.0


@dataclass(frozen=True)
class UplinkComparison:
    """Figures of the log of a run. `gaps`: share of all gaps, by length in log seconds."""

    robots: int
    records: int
    duration_s: float
    rate: float
    doubles: float
    gaps: dict[int, float]
    mean_gap_s: float
    p99_gap_s: float
    longest_gap_s: float

    @property
    def ratio(self) -> float:
        """Ratio of each peak of the gaps to the one before: the geometric mean."""
        first, *_, last = self.gaps.values()
        return float((last / first) ** (1 / (len(self.gaps) - 1))) if first else float("nan")

    @property
    def within_bounds(self) -> bool:
        """Each share of gaps, the ratio of the peaks, doubles."""
        return (
            all(abs(self.gaps[g] / real - 1) <= _GAPS_WITHIN for g, real in _REAL_GAPS.items())
            and abs(self.ratio - _REAL_RATIO) <= _RATIO_WITHIN
            and abs(self.doubles - _REAL_DOUBLES) <= _DOUBLES_WITHIN
        )

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        return {**asdict(self), "ratio": self.ratio, "within_bounds": self.within_bounds}


def compare(folder: Path) -> UplinkComparison:
    """Reads a run folder; InputError if its records do not serve."""
    run = Run.open(folder)
    table = run.tracking()
    if run.experiment.grid is None or len(table) == 0:
        raise InputError(
            f"{folder}: holds no reports of robots; compare a run on a grid, such as "
            "experiments/kilogrid/uplink-100.toml"
        )
    time_s = table["time_s"].to_numpy()
    during = time_s >= 0
    return measure(
        time_s[during],
        table["robot"].to_numpy()[during],
        robots=run.robots_number,
        duration_s=float(run.experiment.duration_s),
    )


def measure(
    time_s: Floats, robot: NDArray[np.integer[Any]], *, robots: int, duration_s: float
) -> UplinkComparison:
    """Records [n]: when the host had each, and the robot that sent it."""
    if duration_s < _LEAST_S:
        raise InputError(f"too short a run; it takes {_LEAST_S:g} s at least, better 3,600")
    order = np.lexsort((time_s, robot))
    time_s, robot = time_s[order], robot[order]
    same = np.diff(robot) == 0
    between = np.diff(time_s)[same]
    seconds = np.floor(time_s / _LOG_SECOND_S).astype(int)
    gaps = np.diff(seconds)[same]
    share = {gap: float(np.mean(gaps == gap)) for gap in _REAL_GAPS}
    return UplinkComparison(
        robots=robots,
        records=len(time_s),
        duration_s=duration_s,
        rate=len(time_s) / robots / duration_s,
        doubles=float(np.count_nonzero(between < _SAME_FRAME_S)) / len(time_s),
        gaps=share,
        mean_gap_s=float(between.mean()),
        p99_gap_s=float(np.percentile(between, 99)),
        longest_gap_s=float(between.max()),
    )


def report_text(comparison: UplinkComparison) -> str:
    """A table: emulated, real, and the bounds."""
    rows = [
        (
            "records per robot and second",
            f"{comparison.rate:.3f}",
            f"{_REAL_RATE:.2f}, with other messages between",
        ),
        (
            "of these heard twice",
            f"{100 * comparison.doubles:.1f} %",
            f"{100 * _REAL_DOUBLES:.1f} +- {100 * _DOUBLES_WITHIN:.0f} %",
        ),
    ]
    rows += [
        (
            f"gaps of {gap} s",
            f"{100 * comparison.gaps[gap]:.1f} %",
            f"{100 * real:.1f} % within a quarter",
        )
        for gap, real in _REAL_GAPS.items()
    ]
    rows += [
        (
            "each peak to the one before",
            f"{comparison.ratio:.2f}",
            f"{_REAL_RATIO} +- {_RATIO_WITHIN}",
        ),
        ("mean gap", f"{comparison.mean_gap_s:.1f} s", "5.0 s"),
        ("99 % of the gaps below", f"{comparison.p99_gap_s:.0f} s", "60 s"),
        ("longest gap", f"{comparison.longest_gap_s:.0f} s", "over 400 s"),
    ]
    lines = [f"{'':34}{'emulated':>10}   real"]
    lines += [f"{name:34}{ours:>10}   {real}" for name, ours, real in rows]
    lines += [
        "",
        f"{comparison.records:,} records of {comparison.robots} robots in "
        f"{comparison.duration_s:,.0f} s. Gaps in log seconds of {_LOG_SECOND_S:.4f} s.",
        "within bounds" if comparison.within_bounds else "OUTSIDE the bounds",
    ]
    return "\n".join(lines)
