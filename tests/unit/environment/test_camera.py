"""An emulated camera: what it sees, what it misses, and how wrong it is."""

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from kilotwin.experiment.schema.environment import EnvironmentTable
from kilotwin.table.environment.camera import EmulatedCamera
from kilotwin.units import TICK_S

if TYPE_CHECKING:
    from kilotwin._emulator import Samples

ROBOTS = 400
EXACT: dict[str, Any] = {"position_noise_m": 0.0, "heading_noise_rad": 0.0, "missed": 0.0}


def camera(seed: int = 1, **keys: Any) -> EmulatedCamera:
    table = EnvironmentTable.model_validate({"program": "a.py:A", **keys})
    return EmulatedCamera(table, seed, lambda robot: ROBOTS - robot)


def samples() -> "Samples":
    across = np.linspace(-1, 1, ROBOTS, dtype=np.float32)[None]
    return {
        "tick": np.array([0]),
        "x_m": across,
        "y_m": -across,
        "heading_rad": 3 * across,
        "led": (np.arange(ROBOTS, dtype=np.uint8) % 64)[None],
        "site": np.zeros((1, ROBOTS), dtype=np.uint8),
    }


def test_without_errors_it_sees_all_as_it_is_in_the_order_of_uids() -> None:
    seen = camera(**EXACT).picture(0, 1.5, samples())
    assert seen.time_s == 1.5
    assert [robot.uid for robot in seen.robots] == list(range(1, ROBOTS + 1))
    last = seen.robots[0]  # uid 1 is the last robot
    assert (last.x_m, last.y_m, last.heading_rad) == (1, -1, 3)
    assert last.led == (399 % 64 & 3, 399 % 64 >> 2 & 3, 399 % 64 >> 4)


def test_errors_have_the_spread_that_was_asked_for() -> None:
    exact = camera(**EXACT).picture(0, 0, samples()).robots
    errors = []
    for number in range(10):
        seen = camera(position_noise_m=0.02, heading_noise_rad=0.3, missed=0.0)
        for robot, true in zip(seen.picture(number, 0, samples()).robots, exact, strict=True):
            errors.append(
                [
                    robot.x_m - true.x_m,
                    robot.y_m - true.y_m,
                    robot.heading_rad - true.heading_rad,
                ]
            )
    spread = np.std(errors, axis=0)
    assert spread == pytest.approx([0.02, 0.02, 0.3], rel=0.05)
    assert np.abs(np.mean(errors, axis=0) / spread).max() < 0.06
    assert np.abs(np.corrcoef(np.transpose(errors))[np.triu_indices(3, 1)]).max() < 0.06


def test_it_misses_its_share_of_robots_each_time_others() -> None:
    seen = [camera(missed=0.25).picture(number, 0, samples()).robots for number in range(10)]
    counts = [len(robots) for robots in seen]
    assert np.mean(counts) == pytest.approx(0.75 * ROBOTS, rel=0.03)
    assert len({tuple(robot.uid for robot in robots) for robots in seen}) == 10


def test_the_same_seed_sees_the_same_and_one_source_of_error_less_changes_no_other() -> None:
    one = camera(missed=0.2).picture(7, 0, samples())
    assert camera(missed=0.2).picture(7, 0, samples()) == one
    assert camera(2, missed=0.2).picture(7, 0, samples()) != one
    sharp = camera(missed=0.2, heading_noise_rad=0.0).picture(7, 0, samples())
    assert [(r.uid, r.x_m) for r in sharp.robots] == [(r.uid, r.x_m) for r in one.robots]


def test_pictures_come_at_their_rate_at_the_first_tick_that_is_not_too_early() -> None:
    ticks = [camera(picture_hz=10.0).tick_of(number) for number in range(100)]
    assert ticks[0] == 0
    late = [tick * TICK_S - number / 10 for number, tick in enumerate(ticks)]
    assert min(late) >= 0
    assert max(late) < TICK_S
