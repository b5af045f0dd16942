"""How a lab's dispatcher polled, by its logs: `python -m tests.truth.dispatcher LOG...`

An original dispatcher asks module after module, row by row, and writes down what each has. So the
order of a `.kilodat`'s rows is finer than its whole seconds: where a module comes before that of
the row above, a new round has begun, and within a round a module's place tells the moment.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kilotwin.errors import InputError, KilotwinError
from kilotwin.table.grid import kilodat
from kilotwin.units import TICK_S

Floats = NDArray[np.float64]

_TICKS_PER_SECOND = 32  # of a log
_WINDOW_TICKS = 2500  # attempts drift apart over longer times
_LEAST_IN_WINDOW = 8
_LEAST_OF_ROBOT = 200
_PERIODS = np.arange(56.0, 72.0, 0.05)


@dataclass(frozen=True)
class Polling:
    """What the order of a log's rows says of it."""

    round_ticks: float
    """From one poll of a module to the next."""
    attempts_ticks: Floats
    """[robots]: from one report of a robot to its next; of robots with 200 reports or more."""


def polling(path: Path) -> Polling:
    """Of a `.kilodat`, packed by xz or not; InputError if its rows are not in a dispatcher's order.

    A row is written within a round of its report, so that a robot's interval is known by how well
    its rows repeat over some forty reports: the period with the largest sum of squares, over
    windows, of the Fourier component of its rows' moments.
    """
    reports = kilodat.read(path)
    if len(reports) < _LEAST_OF_ROBOT:
        raise InputError(f"{path}: {len(reports)} reports; it takes {_LEAST_OF_ROBOT} at least")
    columns = 1 + max(report.x for report in reports)
    place = np.array([report.y * columns + report.x for report in reports])
    second = np.array([report.timestamp for report in reports])
    rounds = np.concatenate([[0], np.cumsum(np.diff(place) < 0)])
    if rounds[-1] > len(reports) / 3:
        what = "rows are not in the order in which a dispatcher goes round"
        raise InputError(f"{path}: {what}; name a lab's log")
    round_ticks = _TICKS_PER_SECOND * float(second[-1] - second[0]) / float(max(rounds[-1], 1))
    at_ticks = round_ticks * (rounds + place / (1 + place.max()))
    robot = np.array([report.data[0] for report in reports])
    periods = [
        _period(at_ticks[robot == one])
        for one in np.unique(robot)
        if np.count_nonzero(robot == one) >= _LEAST_OF_ROBOT
    ]
    return Polling(round_ticks, np.array(periods))


def _period(at_ticks: Floats) -> float:
    window = (at_ticks // _WINDOW_TICKS).astype(int)
    power = np.zeros(len(_PERIODS))
    for one in np.unique(window):
        own = at_ticks[window == one]
        if len(own) >= _LEAST_IN_WINDOW:
            power += np.abs(np.exp(2j * np.pi * own[:, None] / _PERIODS).sum(axis=0)) ** 2
    return float(_PERIODS[power.argmax()])


def line(path: Path, found: Polling) -> str:
    """One log in a line."""
    words = f"{path.name}: a round {found.round_ticks * TICK_S:.3f} s"
    if len(found.attempts_ticks):
        low, middle, high = np.percentile(found.attempts_ticks, [5, 50, 95])
        words += f"; attempts of robots {middle:.2f} ticks apart ({low:.2f} to {high:.2f})"
    return words


def main() -> int:
    """2 for bad input."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("logs", nargs="+", type=Path, metavar="LOG")
    try:
        for path in parser.parse_args().logs:
            sys.stdout.write(line(path, polling(path)) + "\n")
    except KilotwinError as error:
        sys.stderr.write(f"{error}\n")
        return error.exit_code
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
