"""Robots of an experiment's emulated table, calibrated in simulated time, and what that did.

The table is the experiment's, its modules idle. Robots are reached through its modules, as on a
real table. What they truly do is measured elsewhere: each alone on a wide floor.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kilotwin import _emulator
from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.engine import engine_spec
from kilotwin.experiment.spec.overhead import CalibMode, calib
from kilotwin.programs.group import build_group
from kilotwin.session.world import World
from kilotwin.table.grid.clock import SimulatedClock
from kilotwin.table.grid.emulated_links import EmulatedLinks
from kilotwin.table.lab.motor_rounds import Table
from kilotwin.table.links.grid_robots import GridRobots

# World samples nothing by itself.
_NEVER_TICKS = 2**31 - 1
_WAY_M = 1.0
_LONGEST_S = 600.0
_LOOK_S = 1.0
_TURNING_S = 60.0
# No robot gets so far from its begin.
_APART_M = 2.5


class EmulatedTable:
    """The engine with an experiment's robots and modules, and the way to the robots."""

    def __init__(self, experiment: Experiment, changes: Mapping[str, Any] | None = None) -> None:
        """InputError for an experiment without a grid. `changes` of what the engine is given."""
        if experiment.plan is None or experiment.modules is None:
            what = "there is no grid, by which robots are seen; add [grid] with columns and rows"
            raise InputError(f"{experiment.origin.source}: {what}")
        layout = experiment.plan.layout
        guests = [str(build_group(group).file) for group in experiment.groups]
        spec = engine_spec(
            experiment,
            guests,
            sample_ticks=_NEVER_TICKS,
            black_box=None,
            module_guest=str(build_group(experiment.modules).file),
        )
        self._engine = _emulator.Simulation({**spec, **(changes or {})})
        self.clock = SimulatedClock(self._engine, experiment.keys.engine.step_ticks)
        self.link = GridRobots(layout, EmulatedLinks(self._engine, layout.buses), self.clock)
        self.table = Table(layout.columns, layout.rows)

    def close(self) -> None:
        """Frees the robots' memory."""
        self.link.close()
        del self._engine


def true_bends(experiment: Experiment, duties: Mapping[int, Sequence[int]]) -> NDArray[np.float64]:
    """How far each robot's heading turns while it drives its first metre straight on: deg/m.

    By index; positive is counter-clockwise. `duties` by uid, the four of CALIB. Each robot is alone
    on a wide floor, with the motors and the motor noise that the experiment's seed gives it. NaN
    for one that takes more than 600 s.
    """
    with _wide_floor(experiment) as world:
        for index in range(experiment.size):
            _tell(world, index, "straight", duties[experiment.uid_of(index)])
        return _bends(world)


def _wide_floor(experiment: Experiment) -> World:
    """The experiment's robots, each by itself, after their first second."""
    size = experiment.size
    across = math.ceil(math.sqrt(size))
    begins = [
        [(i % across - (across - 1) / 2) * _APART_M, (i // across - (across - 1) / 2) * _APART_M, 0]
        for i in range(size)
    ]
    keys = experiment.keys
    world = World(
        program="firmware/blank.c",
        runtime="kilotwin",  # obeys what is marked as for one robot
        poses=begins,
        arena=(across * _APART_M, across * _APART_M),
        profile=keys.swarm.profile,
        motion={} if keys.motion is None else keys.motion.model_dump(),
        seed=keys.seed,
        command=[],
    )
    world.run(1)
    return world


def true_turns(experiment: Experiment, duties: Mapping[int, Sequence[int]]) -> NDArray[np.float64]:
    """How fast each robot turns on the spot in a minute, deg/s: [left, right] by index.

    As true_bends() has it otherwise.
    """
    rates = []
    for mode in ("turn_left", "turn_right"):
        with _wide_floor(experiment) as world:
            for index in range(experiment.size):
                _tell(world, index, mode, duties[experiment.uid_of(index)])
            world.run(_LOOK_S)
            turned, begun_s = np.zeros(experiment.size), world.time_s
            headings = world.poses[:, 2].astype(np.float64)
            while world.time_s < begun_s + _TURNING_S:
                world.run(_LOOK_S)
                now = world.poses[:, 2].astype(np.float64)
                turned += (now - headings + np.pi) % (2 * np.pi) - np.pi
                headings = now
            rates.append(np.abs(np.degrees(turned)) / (world.time_s - begun_s))
    return np.array(rates)


def _tell(world: World, index: int, mode: CalibMode, duties: Sequence[int]) -> None:
    message = calib(mode, index + 1, duties, only=True)
    world.send(message[:9], message[9])


def _bends(world: World) -> NDArray[np.float64]:
    poses = world.poses.astype(np.float64)
    turned, way = np.zeros(len(poses)), np.zeros(len(poses))
    bends = np.full(len(poses), np.nan)
    while np.isnan(bends).any() and world.time_s < _LONGEST_S:
        world.run(_LOOK_S)
        now = world.poses.astype(np.float64)
        turned += (now[:, 2] - poses[:, 2] + np.pi) % (2 * np.pi) - np.pi
        way += np.hypot(*(now[:, :2] - poses[:, :2]).T)
        poses = now
        arrived = np.isnan(bends) & (way >= _WAY_M)
        bends[arrived] = np.degrees(turned[arrived] / way[arrived])
    return bends
