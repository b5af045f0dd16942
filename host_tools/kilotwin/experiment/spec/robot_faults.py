"""Which robots fail, how and when, as the engine takes it."""

import random

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.robot_fault import RobotFault
from kilotwin.units import ticks

# Tick, index of the robot, kind, and factors of its left and right motor.
TimedFault = tuple[int, int, str, float, float]
# The opposite of a fault that lasts for a while.
_ENDS = {"deaf": "receives", "mute": "transmits"}


def robot_faults(experiment: Experiment) -> list[TimedFault]:
    """Those of [[faults.robot]], drawn by the seed alone. A table draws for every robot alike, so
    that another share or probability changes no draw."""
    return [
        timed
        for index, fault in enumerate(experiment.keys.faults.robot)
        for timed in _of_table(experiment, index, fault)
    ]


def _of_table(experiment: Experiment, index: int, fault: RobotFault) -> list[TimedFault]:
    # Only random() of Python's generator is the same for ever.
    chance = random.Random(f"robot fault {index} {experiment.keys.seed}").random
    draws = [(chance(), chance(), chance()) for _ in experiment.uids]
    robots = range(len(draws))
    if fault.robots is not None:
        named = set(fault.robots)
        chosen = [robot for robot, uid in enumerate(experiment.uids) if uid in named]
    else:
        share = 1.0 if fault.share is None else fault.share
        first = sorted(robots, key=lambda robot: draws[robot][0])
        chosen = sorted(first[: round(share * len(draws))])
    span_s = 0.0 if fault.until_s is None else fault.until_s - fault.at_s
    act = _act(fault)
    timed: list[TimedFault] = []
    for robot in chosen:
        if draws[robot][1] < fault.probability:
            at_s = fault.at_s + draws[robot][2] * span_s
            timed.append((ticks(at_s), robot, *act))
            if fault.for_s is not None:
                timed.append((ticks(at_s + fault.for_s), robot, _ENDS[act[0]], 1.0, 1.0))
    return timed


def _act(fault: RobotFault) -> tuple[str, float, float]:
    if fault.kind == "stuck":
        return "motors", 0.0, 0.0
    if fault.kind == "drift":
        given = (fault.left, fault.right)
        left, right = (1.0 if factor is None else factor for factor in given)
        return "motors", left, right
    return fault.kind, 1.0, 1.0
