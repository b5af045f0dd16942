"""Robots on an ATmega328P and native ones do the same in one world, as far as chance lets one tell.

All start at random poses, so that, if the two kinds are the same, it is chance which is which. The
bounds come from that: a kind's mean may be no farther from the other's than in all but 0.1 % of
random divisions of the same robots into groups of these sizes.
"""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kilotwin import World

ROOT = Path(__file__).resolve().parents[2]
EXPERIMENT = ROOT / "experiments/porting/native-and-avr.toml"
ON_BOARD = 10
STEP_TICKS = 4
DIVISIONS = 20_000
OUTSIDE = 0.001

# Behaviour of a robot, one number each.
STATISTICS = [
    *(
        f"share of time {state}"
        for state in ("walking", "entering", "resting", "leaving", "avoiding")
    ),
    "changes of the LED",
    *(f"share of time {motion}" for motion in ("straight", "left", "right", "standing")),
    "changes of the motors",
    "frames sent",
    "frames received",
]

Table = NDArray[np.float64]


def lived(seed: int, for_s: float, **settings: float) -> Table:
    """[robots, statistics] of one world."""
    given = [f"{key.replace('__', '.')}={value}" for key, value in settings.items()]
    with World(EXPERIMENT, seed=seed, set=given) as world:
        names, leds, motors = [], [], []
        while world.time_s < for_s:
            world.run_ticks(STEP_TICKS)
            names.append(world.states)
            leds.append(world.leds)
            motors.append(world.motors > 0)
        assert not [event for event in world.events if event["kind"] != "print"]
        frames = world.frames
    states, led = np.array(names), np.array(leds)
    left, right = np.moveaxis(np.array(motors), 2, 0)
    columns = [
        *(
            (states == name).mean(axis=0)
            for name in ("walking", "entering", "resting", "leaving", "avoiding")
        ),
        (np.diff(led, axis=0) != 0).sum(axis=0),
        *(
            when.mean(axis=0)
            for when in (left & right, left & ~right, right & ~left, ~left & ~right)
        ),
        (np.diff(left, axis=0) | np.diff(right, axis=0)).sum(axis=0),
        *frames.T,
    ]
    return np.column_stack(columns).astype(float)


def distances(worlds: list[Table], dice: np.random.Generator) -> tuple[Table, Table]:
    """By statistic: how far the kinds' means are apart, and how far they may be.

    Robots of one world are divided among themselves: worlds differ.
    """
    count = len(worlds[0])

    def apart(on_board: list[NDArray[np.intp]]) -> Table:
        by_world = [
            robots[chosen].mean(axis=0) - np.delete(robots, chosen, axis=0).mean(axis=0)
            for robots, chosen in zip(worlds, on_board, strict=True)
        ]
        means: Table = np.abs(np.array(by_world).mean(axis=0))
        return means

    found = apart([np.arange(ON_BOARD)] * len(worlds))
    divided = [
        apart([dice.permutation(count)[:ON_BOARD] for _ in worlds]) for _ in range(DIVISIONS)
    ]
    return found, np.quantile(np.array(divided), 1 - OUTSIDE, axis=0)


def assert_the_same(worlds: list[Table]) -> None:
    found, allowed = distances(worlds, np.random.default_rng(1))
    rows = [
        f"{name:24} AVR {np.mean([w[:ON_BOARD, i].mean() for w in worlds]):8.3f}  "
        f"native {np.mean([w[ON_BOARD:, i].mean() for w in worlds]):8.3f}  "
        f"apart {found[i]:7.3f} of {allowed[i]:7.3f}"
        for i, name in enumerate(STATISTICS)
    ]
    print(*rows, sep="\n")
    assert (found <= allowed).all(), "\n".join(rows)


def test_a_mixed_swarm_is_one_swarm() -> None:
    assert_the_same([lived(seed=1, for_s=120)])


@pytest.mark.long
def test_a_mixed_swarm_is_one_swarm_for_ten_minutes() -> None:
    assert_the_same([lived(seed, for_s=600) for seed in (1, 2, 3)])


def test_the_bounds_tell_kinds_that_differ_by_a_standard_deviation_and_a_half() -> None:
    dice = np.random.default_rng(5)
    same = dice.normal(size=(50, 40))
    assert (np.less_equal(*distances([same], dice))).all()
    same[:ON_BOARD] += 1.5
    found, allowed = distances([same], dice)
    assert (found > allowed).mean() > 0.6
