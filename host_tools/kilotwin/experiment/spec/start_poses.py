"""Start poses of robots: given, or drawn in the part of the arena that the experiment names."""

import math
import random

import numpy as np
from numpy.typing import NDArray

from kilotwin.experiment.areas import disc
from kilotwin.experiment.checks.arena import standing_in
from kilotwin.experiment.checks.object import object_at, placed_objects
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.profile_defaults import PROFILES

# Between two robots, so that none begins in contact.
_GAP_M = 0.001
_TRIES = 10_000

Poses = NDArray[np.float64]


def starts(experiment: Experiment) -> list[Poses | None]:
    """[count, 3] of each group: x_m, y_m, heading_rad. None: the engine places it anywhere.

    Places in `start_in_m` depend on the seed alone. InputError if there is no room.
    """
    keys = experiment.keys
    given = [
        None if group.poses is None else np.array(group.poses, dtype=np.float64)
        for group in experiment.groups
    ]
    if keys.swarm.start_in_m is None:
        return given
    radius = PROFILES[keys.swarm.profile].radius_m
    left, bottom, right, top = keys.swarm.start_in_m
    # Only random() of Python's generator is the same for ever.
    chance = random.Random(f"starts {keys.seed}").random
    objects = placed_objects(keys)
    taken = [(x, y) for poses in given if poses is not None for x, y, _ in poses]
    placed: list[Poses | None] = []
    for group, poses in zip(experiment.groups, given, strict=True):
        if poses is not None:
            placed.append(poses)
            continue
        rows = []
        for _ in range(group.count):
            for _ in range(_TRIES):
                x = left + radius + chance() * (right - left - 2 * radius)
                y = bottom + radius + chance() * (top - bottom - 2 * radius)
                alone = all(math.hypot(x - a, y - b) >= 2 * radius + _GAP_M for a, b in taken)
                robot = disc(x, y, 2 * radius)
                if alone and standing_in(keys, robot) is None and object_at(robot, objects) is None:
                    break
            else:
                what = f"{group.count} robots find no room in that rectangle; make it larger"
                raise experiment.error(("swarm", "start_in_m"), what)
            taken.append((x, y))
            rows.append((x, y, (2 * chance() - 1) * math.pi))
        placed.append(np.array(rows, dtype=np.float64))
    return placed
