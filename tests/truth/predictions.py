"""Intervals in which real runs are expected, from many simulated ones: what docs/predictions.md
says, made by `python -m tests.truth.predictions FOLDER` of a sweep of
experiments/kilogrid/update-time/planned.toml.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kilotwin.errors import InputError, KilotwinError

from .update_time import Course, courses

_MINUTES = (10, 20, 30, 40, 50, 60)
_LATE_S = 60.0  # the farthest that a sample may be from its minute
_TEN, _SERIES_OF_TEN, _SEED = 10, 4000, 1
_HALF, _MOST = (25, 75), (5, 95)


@dataclass(frozen=True)
class Prediction:
    """Robots in one place after some minutes: the median of all runs, the intervals that hold half
    and nine tenths of single runs, and that of nine tenths of the medians of ten runs."""

    minute: int
    place: str
    runs: int
    median: float
    half: tuple[float, float]
    most: tuple[float, float]
    ten: tuple[float, float]

    @staticmethod
    def of(minute: int, place: str, values: NDArray[np.float64]) -> "Prediction":
        """By the runs' values, [runs]."""
        tens = np.random.default_rng(_SEED).choice(values, (_SERIES_OF_TEN, _TEN))
        medians = np.median(tens, axis=1)
        return Prediction(
            minute,
            place,
            len(values),
            float(np.median(values)),
            _between(values, _HALF),
            _between(values, _MOST),
            _between(medians, _MOST),
        )

    def row(self) -> str:
        """A line of the table."""
        intervals = (f"{low:.0f} to {high:.0f}" for low, high in (self.half, self.most))
        ten = f"{self.ten[0]:g} to {self.ten[1]:g}"
        return (
            f"| {self.minute} | {self.place} | {self.median:g} | {' | '.join(intervals)} | {ten} |"
        )


def _between(values: NDArray[np.float64], percent: tuple[int, int]) -> tuple[float, float]:
    """Values that were seen: robots are whole."""
    low, high = np.percentile(values, percent, method="inverted_cdf")
    return float(low), float(high)


def predictions(runs: list[Course]) -> Iterator[Prediction]:
    """All moments and places. InputError of runs that ended before the last moment."""
    for minute in _MINUTES:
        at = [_sample(run, 60.0 * minute) for run in runs]
        black = np.array([run.black[i] for run, i in zip(runs, at, strict=True)])
        white = np.array([run.white[i] for run, i in zip(runs, at, strict=True)])
        outside = np.array([float(run.robots) for run in runs]) - black - white
        for place, values in (("black", black), ("white", white), ("outside", outside)):
            yield Prediction.of(minute, place, values)


def _sample(run: Course, time_s: float) -> int:
    nearest = int(np.abs(run.time_s - time_s).argmin())
    if abs(run.time_s[nearest] - time_s) > _LATE_S:
        raise InputError(f"a run has no sample near {time_s:g} s; runs of an hour are needed")
    return nearest


def report_text(series: Mapping[str, list[Course]]) -> str:
    """A table in Markdown for each series of runs."""
    lines: list[str] = []
    for name, runs in series.items():
        lines += [
            f"**{name}**, by {len(runs)} simulated runs:",
            "",
            "| minute | robots | median | half of runs | nine of ten runs | median of ten runs |",
            "|---|---|---|---|---|---|",
            *(prediction.row() for prediction in predictions(runs)),
            "",
        ]
    return "\n".join(lines)


def main() -> int:
    """2 for bad input."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    given = parser.parse_args()
    try:
        series: dict[str, list[Course]] = {}
        for row, run in courses(given.folder):
            series.setdefault(row["name"], []).append(run)
        text = report_text(series)
    except KilotwinError as error:
        sys.stderr.write(f"{error}\n")
        return error.exit_code
    sys.stdout.write(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
