"""Compares random walkers with real ones: 98 to 100 Kilobots on a Kilogrid of 1 x 2 m, four runs.

The grid saw the real robots through cells of 5 cm, now and then. Emulated tracks are seen likewise
before they are compared: the cells dominate what is found at small lags.
"""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kilotwin.errors import InputError
from kilotwin.files.headers import CELL_M
from kilotwin.runs.reader import Run
from kilotwin.units import TICK_S

Floats = NDArray[np.float64]

_LOG_SECOND_S = 32 * TICK_S
_ATTEMPT_S = 2.0
# Of the real attempts 0.55 were received, and of all records 12.6 % were the second of one frame.
# Two cells that receive independently, the one below the robot and the nearest other, give both:
# own + other - own * other = 0.55, own * other = 0.126 * (own + other).
_OWN_HEARS, _OTHER_HEARS = 0.4549, 0.1744

_MEASURES = ("rms", "median", "p95", "p99")
# Displacement in cm by lag in log seconds (hardware.md 2.1).
_REAL = {
    4: (5.9, 5.0, 11.2, 11.2),
    10: (9.4, 7.1, 15.8, 18.0),
    20: (14.1, 11.2, 25.0, 27.6),
    30: (17.8, 15.0, 31.6, 37.0),
    60: (25.2, 20.3, 46.0, 57.0),
    120: (34.0, 25.5, 63.0, 81.0),
    300: (48.5, 38.0, 87.0, 111.0),
}
_ROBOT_LAG = 10
_REAL_ROBOT_MEAN_CM = 9.3
_REAL_ROBOT_SD_CM = (1.1, 1.5)

_WITHIN = 0.10
_SPREAD_WITHIN = 0.25


@dataclass(frozen=True)
class WalkRow:
    """One lag: real and emulated displacement, cm."""

    lag: int
    pairs: int
    real: dict[str, float]
    emulated: dict[str, float]


@dataclass(frozen=True)
class WalkComparison:
    """`robot_*`: over the robots, of each one's rms displacement in ten log seconds."""

    rows: list[WalkRow]
    robot_mean_cm: float
    robot_sd_cm: float
    robot_least_cm: float
    robot_most_cm: float

    @property
    def within_bounds(self) -> bool:
        """The rms displacements within 10 %, the spread over robots within 25 %."""
        low, high = _REAL_ROBOT_SD_CM
        return (
            all(abs(row.emulated["rms"] / row.real["rms"] - 1) <= _WITHIN for row in self.rows)
            and abs(self.robot_mean_cm / _REAL_ROBOT_MEAN_CM - 1) <= _WITHIN
            and low * (1 - _SPREAD_WITHIN) <= self.robot_sd_cm <= high * (1 + _SPREAD_WITHIN)
        )

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        return {**asdict(self), "within_bounds": self.within_bounds}


def compare(folder: Path) -> WalkComparison:
    """Reads a run folder; InputError if its records do not serve."""
    run = Run.open(folder)
    keys = run.experiment
    if keys.arena.shape != "rectangle" or keys.record.sample_s > 1:
        raise InputError(
            f"{folder}: not a run to compare; it takes a rectangle and record.sample_s up to 1, "
            "as experiments/kilogrid/random-walk-100.toml has"
        )
    assert keys.arena.width_m is not None
    assert keys.arena.height_m is not None
    record = keys.record
    if record.robots_every * record.sample_s > 1 or record.robots_of(run.robots_number) is not None:
        what = "[record] left out robots, or wrote them down more rarely than once a second"
        raise InputError(f"{folder}: {what}; leave those keys out and repeat the run")
    table = run.robots("x_m", "y_m")
    robots = len(np.unique(table["robot"].to_numpy()))
    time_s = table["time_s"].to_numpy().reshape(-1, robots)[:, 0]
    track = np.stack(
        [table[axis].to_numpy().reshape(-1, robots).astype(float) for axis in ("x_m", "y_m")],
        axis=-1,
    )
    size = np.array([keys.arena.width_m, keys.arena.height_m])
    if time_s[-1] < max(_REAL) * _LOG_SECOND_S:
        raise InputError(f"{folder}: too short a run; it takes 315 s at least, better 3,600")
    seen = records(time_s, track, size, np.random.default_rng(keys.seed))
    return measure(seen)


def records(time_s: Floats, track: Floats, size: Floats, chance: np.random.Generator) -> Floats:
    """The grid's log of tracks [samples, robots, 2] in m.

    [log seconds, robots, 2 cells, 2]: the centres of the cell below the robot and of the nearest
    other one, if they received it in that second; NaN if not.
    """
    robots = track.shape[1]
    seen = np.full((int(time_s[-1] / _LOG_SECOND_S) + 1, robots, 2, 2), np.nan)
    for robot in range(robots):
        attempts = np.arange(chance.uniform(0, _ATTEMPT_S), time_s[-1], _ATTEMPT_S)
        place = np.stack(
            [np.interp(attempts, time_s, track[:, robot, axis]) for axis in (0, 1)], axis=-1
        )
        when = (attempts / _LOG_SECOND_S).astype(int)
        for cell, (centre, share) in enumerate(
            zip(cells(place, size), (_OWN_HEARS, _OTHER_HEARS), strict=True)
        ):
            received = chance.random(len(attempts)) < share
            seen[when[received], robot, cell] = centre[received]
    return seen


def cells(place: Floats, size: Floats) -> tuple[Floats, Floats]:
    """The centres of the cell below each place and of the nearest other cell."""
    last = np.round(size / CELL_M) - 1
    index = np.clip(np.floor((place + size / 2) / CELL_M), 0, last)
    centre = (index + 0.5) * CELL_M - size / 2
    away = place - centre
    nearer = np.abs(away).argmax(axis=1)
    rows = np.arange(len(place))
    step = np.where(away[rows, nearer] < 0, -1, 1)
    neighbour = index.copy()
    neighbour[rows, nearer] += step
    outside = (neighbour < 0) | (neighbour > last)
    neighbour[outside] -= 2 * np.broadcast_to(step[:, None], index.shape)[outside]
    return centre, (neighbour + 0.5) * CELL_M - size / 2


def displacements_cm(seen: Floats, lag: int) -> Floats:
    """[pairs of seconds, robots, 4]: between all records of two seconds so far apart; NaN: none."""
    before, after = seen[:-lag, :, :, None], seen[lag:, :, None, :]
    distance: Floats = 100 * np.linalg.norm(after - before, axis=-1)
    return distance.reshape(len(seen) - lag, seen.shape[1], 4)


def measure(seen: Floats) -> WalkComparison:
    """Compares what the grid has logged, as `records` gives it."""
    rows = []
    for lag, real in _REAL.items():
        found = displacements_cm(seen, lag)
        found = found[np.isfinite(found)]
        values = (_rms(found), *np.percentile(found, [50, 95, 99]))
        emulated = {name: float(value) for name, value in zip(_MEASURES, values, strict=True)}
        rows.append(WalkRow(lag, len(found), dict(zip(_MEASURES, real, strict=True)), emulated))
    each = displacements_cm(seen, _ROBOT_LAG).transpose(1, 0, 2).reshape(seen.shape[1], -1)
    of_robots = np.array([_rms(robot[np.isfinite(robot)]) for robot in each])
    return WalkComparison(
        rows,
        float(of_robots.mean()),
        float(of_robots.std(ddof=1)),
        float(of_robots.min()),
        float(of_robots.max()),
    )


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def report_text(comparison: WalkComparison) -> str:
    """A table: emulated, real, and the difference of the two."""
    lines = ["displacement in cm, emulated / real (difference)", ""]
    lines.append("lag  " + "".join(f"{name:<24}" for name in _MEASURES).rstrip())
    for row in comparison.rows:
        cells_text = [
            f"{row.emulated[name]:6.1f} /{row.real[name]:6.1f} "
            f"({100 * (row.emulated[name] / row.real[name] - 1):+4.0f} %)"
            for name in _MEASURES
        ]
        lines.append(f"{row.lag:<5}" + "".join(f"{text:<24}" for text in cells_text).rstrip())
    low, high = _REAL_ROBOT_SD_CM
    lines += [
        "",
        f"rms in {_ROBOT_LAG} log seconds, robot by robot: "
        f"mean {comparison.robot_mean_cm:.2f} (real {_REAL_ROBOT_MEAN_CM}), "
        f"sd {comparison.robot_sd_cm:.2f} (real {low} to {high}), "
        f"range {comparison.robot_least_cm:.1f} to {comparison.robot_most_cm:.1f} (real 4 to 13)",
        f"Lags in log seconds of {_LOG_SECOND_S:.4f} s. Tracks as the grid sees them: cells of "
        f"{100 * CELL_M:.0f} cm, an attempt each {_ATTEMPT_S:.0f} s, 55 % heard.",
        "within bounds" if comparison.within_bounds else "OUTSIDE the bounds: rms 10 %, sd 25 %",
    ]
    return "\n".join(lines)
