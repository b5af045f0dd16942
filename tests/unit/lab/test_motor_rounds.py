"""Robots on a table get straighter, and what goes wrong with one of them does no harm."""

import numpy as np
import pytest

from kilotwin.table.lab.motor_rounds import MotorRounds, Table
from kilotwin.table.lab.wheels import LEAST_DUTY, MOST_TURN_DUTY

from .fake_table import FakeTable


def calibrate(table: FakeTable, rounds: int = 3, *, turns: bool = True) -> MotorRounds:
    """All robots of the table, which come with the usual duties."""
    columns = round(float(table.size[0]) / 0.1)
    duties = dict.fromkeys(range(1, len(table.at) + 1), (65, 66, 70, 70))
    work = MotorRounds(table, table, Table(columns, table.rows), duties)
    work.run(rounds, turns=turns)
    return work


def bends(table: FakeTable, work: MotorRounds, uids: list[int]) -> tuple[float, float]:
    """Medians of how far robots turn in a metre, before and after: rad."""
    before = [abs(table.turn_per_m(uid - 1, 70, 70)) for uid in uids]
    after = [abs(table.turn_per_m(uid - 1, *work.robots[uid].straight)) for uid in uids]
    return float(np.median(before)), float(np.median(after))


def test_fifty_robots_get_straighter_by_far() -> None:
    table = FakeTable(10, 20, 50)
    work = calibrate(table)
    saved = [uid for uid, robot in work.robots.items() if robot.saved]
    assert len(saved) >= 45
    before, after = bends(table, work, saved)
    assert after < before / 5
    for uid in saved:
        robot = work.robots[uid]
        assert tuple(table.saved[uid - 1]) == (*robot.turns, *robot.straight)


def test_fifty_robots_turn_alike_by_far() -> None:
    """By the strength of their motors, which their ways show; those that can be fast enough."""
    table = FakeTable(10, 20, 50)
    work = calibrate(table)
    measured = [robot for robot in work.robots.values() if robot.measured]
    strength = np.array([table.strength[robot.uid - 1] for robot in measured])
    turns = np.array([robot.turns for robot in measured])
    before, after = strength, strength * turns
    free = (turns > LEAST_DUTY) & (turns < MOST_TURN_DUTY)
    assert free.mean() > 0.6
    assert after[free].std() / after[free].mean() < before.std() / before.mean() / 2.5


def test_a_robot_that_is_not_seen_keeps_its_duties() -> None:
    table = FakeTable(4, 6, 5)
    table.deaf = {3}
    work = calibrate(table, rounds=1)
    assert work.robots[3].measured == 0
    assert not work.robots[3].saved
    assert work.robots[3].straight == (70, 70)
    assert work.robots[3].turns == (65, 66)
    assert all(robot.saved for robot in work.robots.values() if robot.measured)
    assert sum(robot.measured for robot in work.robots.values()) >= 2


def test_turns_keep_their_duties_if_they_are_to() -> None:
    work = calibrate(FakeTable(4, 6, 3), rounds=1, turns=False)
    assert {robot.turns for robot in work.robots.values()} == {(65, 66)}


def test_it_says_how_far_it_is() -> None:
    said: list[tuple[str, float]] = []
    table = FakeTable(4, 6, 3)
    work = MotorRounds(
        table,
        table,
        Table(4, 6),
        dict.fromkeys((1, 2, 3), (65, 65, 70, 70)),
        lambda text, share: said.append((text, share)),
    )
    work.run(rounds=2)
    assert {text for text, _ in said} >= {"round 1 of 2: they drive", "round 2 of 2: they drive"}
    assert all(0 <= share <= 1 for _, share in said)


def test_cells_lie_as_the_hardware_numbers_them() -> None:
    table = Table(2, 3)
    assert table.middle((0, 0), 0) == pytest.approx((0.025, 0.075))
    assert table.middle((1, 2), 3) == pytest.approx((0.175, 0.225))
    assert table.is_rim(0.025, 0.15)
    assert table.is_rim(0.1, 0.275)
    assert not table.is_rim(0.075, 0.075)
