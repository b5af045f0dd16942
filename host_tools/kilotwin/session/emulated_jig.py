"""Pairs of an experiment's emulated robots, brought to one distance after the other.

Robots cannot be moved by hand in the engine: for each distance there is a table of its own, with
the same robots on it. They are reached through its modules, as on a real table.
"""

import math
from collections.abc import Sequence

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.engine import engine_spec
from kilotwin.experiment.spec.overhead import WAKEUP
from kilotwin.files.headers import GAIN_DISTANCES_MM, MODULE_M, MOST_PER_BUS
from kilotwin.session.emulated_calibration import EmulatedTable
from kilotwin.session.world import experiment_of
from kilotwin.table.links.robot_link import RobotLink

# Sections that distinguish robots, and say how they receive.
_OF_ROBOTS = ("seed", "profile", "medium", "lab")
# Limit of a range, in spreads.
_RANGE_LIMIT = 3
_FREE_M = 0.01
# Chance goes by how many frames a robot has received: with so many more before each distance no
# two distances have the same noise.
_APART_S = 10.0


class EmulatedJig:
    """Robots 1 and 2, 3 and 4 ... of an experiment's uids in order, as pairs."""

    def __init__(self, experiment: Experiment) -> None:
        """InputError if robots are odd in number, or do not read strengths."""
        source = experiment.origin.source
        if experiment.keys.medium.kind != "kilobot":
            what = 'its robots are told distances; take [medium] kind = "kilobot"'
            raise InputError(f"{source}: {what}")
        if experiment.size % 2:
            what = f"pairs are made of an even number of robots; it has {experiment.size}"
            raise InputError(f"{source}: {what}")
        self.how = f"emulated:{source}"
        self._experiment = experiment
        self._table: EmulatedTable | None = None
        self._places = 0
        self._passed_s = 0.0
        uids = [experiment.uid_of(index) for index in range(experiment.size)]
        self.pairs = tuple(zip(uids[::2], uids[1::2], strict=True))

    @property
    def simulated_s(self) -> float:
        """Simulated time of all tables so far, s."""
        return self._passed_s + (self._table.clock.now_s() if self._table else 0.0)

    def place(self, mm: int) -> RobotLink:
        """As Jig has it: a new table. The one before is gone, with its robots' EEPROM."""
        self.close()
        own = engine_spec(
            self._experiment,
            [""] * len(self._experiment.groups),
            sample_ticks=1,
            black_box=None,
        )
        self._table = EmulatedTable(self._experiment_at(mm), {key: own[key] for key in _OF_ROBOTS})
        if self._places:
            self._table.link.repeat(WAKEUP, self._places * _APART_S)
        self._places += 1
        return self._table.link

    def close(self) -> None:
        """Frees the robots' memory."""
        if self._table is not None:
            self._passed_s += self._table.clock.now_s()
            self._table.close()
        self._table = None

    def _experiment_at(self, mm: int) -> Experiment:
        """A table on which each pair is beyond the reach of the others."""
        medium = self._experiment.keys.medium
        reach_m = medium.range_m * (1 + _RANGE_LIMIT * (medium.range_spread or 0)) + _FREE_M
        step_x, step_y = reach_m + GAIN_DISTANCES_MM[-1] / 1000, reach_m
        across = max(1, round(math.sqrt(len(self.pairs) * step_y / step_x)))
        down = math.ceil(len(self.pairs) / across)
        columns = math.ceil(across * step_x / MODULE_M)
        rows = math.ceil(down * step_y / MODULE_M)
        poses: list[Sequence[float]] = []
        for pair in range(len(self.pairs)):
            x = (pair % across - (across - 1) / 2) * step_x
            y = (pair // across - (down - 1) / 2) * step_y
            poses += [[x - mm / 2000, y, 0.0], [x + mm / 2000, y, 0.0]]
        grid = {"columns": columns, "rows": rows, "buses": -(-columns * rows // MOST_PER_BUS)}
        blank = {"program": "firmware/blank.c", "runtime": "kilotwin"}  # it answers questions
        return experiment_of({**blank, "poses": poses, "grid": grid}, [])
