"""Logs of collective perception (docs/collective_perception.md): read, and measured.

Times are log seconds of 32 ticks, as a `.kilodat` has them. A robot's place is the middle of the
cell that received it.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kilotwin.errors import InputError
from kilotwin.files.headers import CELL_M
from kilotwin.runs.reader import Run
from kilotwin.table.grid import kilodat

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Measures = dict[str, float]

LAGS = (4, 10, 20, 30, 60, 120, 300)
WINDOWS = ((5, 35), (35, 65), (65, 125), (300, 600))
GAPS = (1, 2, 3, 4, 8)
LONG_GAP = 40
"""A gap that is called long."""
LEAST_SECONDS = 600
_PARTS = (10, 50, 100)  # of a run, percent
_AGREED = 0.8
_ROBOT_LAG = 10
_LEAST_PAIRS = 30  # of a robot, for its own displacement
_CELL_CM = 100 * CELL_M
_KILODAT = (".kilodat", ".kilodat.xz")
# Bytes of a report: uid, opinion, state, action, quality x 255.
_OPINION, _STATE, _ACTION = 1, 2, 3
_DISSEMINATION, _DECISION, _WALL = 2, 3, 2
_HOUR = 3600.0


@dataclass(frozen=True)
class Log:
    """Reports, in order of robot and then of time: [n] each."""

    source: str
    seconds: int
    """How long the run was, log seconds."""
    robots: int
    second: Ints
    robot: Ints
    column: Ints
    row: Ints
    opinion: Ints
    state: Ints
    action: Ints

    @property
    def place_cm(self) -> Floats:
        """[n, 2]: where each was received."""
        place: Floats = np.stack([self.column, self.row], axis=-1).astype(np.float64)
        return _CELL_CM * (place + 0.5)

    @property
    def same(self) -> NDArray[np.bool_]:
        """[n - 1]: whether a report and the next one are of the same robot."""
        same: NDArray[np.bool_] = np.diff(self.robot) == 0
        return same


def read(path: Path) -> Log:
    """A run folder, or a lab's `.kilodat`, packed by xz or not; InputError if it does not serve."""
    log = _of_kilodat(path) if path.name.endswith(_KILODAT) else _of_run(path)
    if log.seconds < LEAST_SECONDS:
        what = f"{log.seconds} log seconds are too short a run"
        raise InputError(f"{path}: {what}; it takes {LEAST_SECONDS} at least, better 3,600")
    return log


def _of_kilodat(path: Path) -> Log:
    reports = kilodat.read(path)
    table = np.array([(r.timestamp, r.x, r.y, r.cell) for r in reports], dtype=np.int64)
    data = np.array([list(r.data.ljust(kilodat.DATA_BYTES, b"\0")) for r in reports])
    return _log(path, table.reshape(-1, 4), data.reshape(-1, kilodat.DATA_BYTES), None, None)


def _of_run(folder: Path) -> Log:
    run = Run.open(folder)
    rows = run.tracking()
    time_s = rows["time_s"].to_numpy()
    names = ("module_x", "module_y", "cell")
    second = np.floor(np.maximum(time_s, 0.0) / kilodat.UNIT_S)
    table = np.column_stack([second, *(rows[name].to_numpy() for name in names)])
    data = np.frombuffer(b"".join(rows["data"].to_pylist()), dtype=np.uint8)
    data = data.reshape(-1, kilodat.DATA_BYTES)
    during = time_s >= 0
    length = int(run.experiment.duration_s / kilodat.UNIT_S)
    return _log(
        folder,
        table[during].astype(np.int64),
        data[during].astype(np.int64),
        run.robots_number,
        length if run.manifest.get("status") == "finished" else None,
    )


def _log(
    path: Path, table: Ints, data: NDArray[Any], robots: int | None, seconds: int | None
) -> Log:
    """Log of second, module and cell [n, 4] and the bytes [n, 7] of reports."""
    if not len(table):
        raise InputError(f"{path}: holds no reports of robots; name a run on a grid")
    robot, state = data[:, 0], data[:, _STATE]
    if state.max() > _DECISION or not np.any(state == _DISSEMINATION):
        what = "its reports are not those of collective perception"
        where = "experiments/kilogrid/collective-perception/"
        raise InputError(f"{path}: {what}; name a run of {where} or a lab's log of it")
    order = np.lexsort((table[:, 0], robot))
    table, data = table[order], data[order]
    second, x, y, cell = table.T
    return Log(
        str(path),
        seconds or int(second.max()) + 1,
        robots or len(np.unique(robot)),
        second,
        data[:, 0].astype(np.int64),
        2 * x + cell % 2,
        2 * y + (cell < 2),
        data[:, _OPINION].astype(np.int64),
        data[:, _STATE].astype(np.int64),
        data[:, _ACTION].astype(np.int64),
    )


def measure(log: Log) -> Measures:
    """The rows of docs/collective_perception.md 2, by name."""
    found = {
        "rate": len(log.second) / log.robots / log.seconds,
        **_rates(log),
        **_gaps(log),
        "dissemination": float(np.mean(log.state == _DISSEMINATION)),
        "wall": float(np.mean(log.action == _WALL)),
        **_displacements(log),
        **_opinions(log),
    }
    return {name: float(value) for name, value in found.items()}


def _rates(log: Log) -> Measures:
    return {
        f"rate {begin}-{end}": np.count_nonzero((log.second >= begin) & (log.second < end))
        / log.robots
        / (end - begin)
        for begin, end in WINDOWS
    }


def _gaps(log: Log) -> Measures:
    """Two reports of a robot in one log second are one frame, received by two cells."""
    gaps = np.diff(log.second)[log.same]
    apart = gaps[gaps > 0]
    long_ = apart[apart >= LONG_GAP]
    hours = log.seconds * kilodat.UNIT_S / _HOUR
    return {
        "twice": float(np.mean(gaps == 0)),
        **{f"gap {gap}": float(np.mean(apart == gap)) for gap in GAPS},
        "long gaps": len(long_) / log.robots / hours,
        "long gap": float(long_.mean()) if len(long_) else 0.0,
        "longest gap": float(apart.max(initial=0)),
    }


def _pairs(log: Log, lag: int) -> tuple[Ints, Ints]:
    """All pairs of reports of a robot that are so far apart: indices of the first, the second."""
    key = log.robot * (2 * log.seconds + lag + 1) + log.second
    begin = np.searchsorted(key, key + lag, "left")
    count = np.searchsorted(key, key + lag, "right") - begin
    first = np.repeat(np.arange(len(key)), count)
    within = np.arange(len(first)) - np.repeat(np.cumsum(count) - count, count)
    return first, np.repeat(begin, count) + within


def _displacements(log: Log) -> Measures:
    """Root mean squares over all pairs, cm; and how robots differ at a lag of ten."""
    place = log.place_cm
    found = {}
    for lag in LAGS:
        first, second = _pairs(log, lag)
        square = np.sum((place[second] - place[first]) ** 2, axis=1)
        found[f"displacement {lag}"] = float(np.sqrt(square.mean())) if len(square) else 0.0
        if lag == _ROBOT_LAG:
            number = np.bincount(log.robot[first])
            total = np.bincount(log.robot[first], square)
            own = np.sqrt(total[number >= _LEAST_PAIRS] / number[number >= _LEAST_PAIRS])
            found["spread"] = float(own.std() / own.mean()) if len(own) else 0.0
            found["slowest"] = float(own.min(initial=np.inf)) if len(own) else 0.0
    return found


def _opinions(log: Log) -> Measures:
    changes = np.count_nonzero(np.diff(log.opinion)[log.same])
    hours = log.seconds * kilodat.UNIT_S / _HOUR
    most = _largest_share(log)
    found = {
        f"largest at {part}": float(most[min(part * log.seconds // 100, log.seconds - 1)])
        for part in _PARTS
    }
    agreed = np.flatnonzero(most >= _AGREED)
    minutes = agreed[0] * kilodat.UNIT_S / 60 if len(agreed) else np.inf
    return {"changes": changes / log.robots / hours, **found, "agreed": float(minutes)}


def _largest_share(log: Log) -> Floats:
    """[seconds]: of the robots reported so far, the share of the commonest opinion in each second.

    A robot has the opinion that it reported last.
    """
    count = np.zeros((log.seconds, int(log.opinion.max()) + 1), dtype=np.int64)
    for robot in np.unique(log.robot):
        own = log.robot == robot
        second, opinion = np.minimum(log.second[own], log.seconds - 1), log.opinion[own]
        last = np.flatnonzero(np.append(np.diff(second) > 0, True))
        begin, end = second[last], np.append(second[last][1:], log.seconds)
        for value, since, until in zip(opinion[last], begin, end, strict=True):
            count[since:until, value] += 1
    share: Floats = count.max(axis=1) / np.maximum(count.sum(axis=1), 1)
    return share
