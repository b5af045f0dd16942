"""Gain tables of pairs of robots: what is read, fitted, written and asked for again."""

import numpy as np
import pytest
from tests.unit.lab.fake_pairs import FakePairs

from kilotwin.files.headers import GAIN_DISTANCES_MM
from kilotwin.table.lab.ranging import Ranging

PAIRS = ((1, 2), (3, 4))


def test_each_robot_gets_the_tables_of_its_own_receiver() -> None:
    pairs = FakePairs(4)
    work = Ranging(PAIRS, pairs)
    work.run()
    assert pairs.placed == list(GAIN_DISTANCES_MM)
    for uid, robot in work.robots.items():
        assert robot.tables is not None
        true = np.array([pairs.strength(uid - 1, mm) for mm in GAIN_DISTANCES_MM])
        measured = np.array([robot.tables.low, robot.tables.high]).T
        assert np.abs(measured - true).max() <= 4
        assert robot.saved
        assert (pairs.eeprom[uid - 1] == measured).all()


def test_a_reading_counts_once_however_often_it_is_told() -> None:
    """The answers of a robot whose partner is silent tell the same again and again."""
    pairs = FakePairs(2)
    pairs.deaf = {2}
    work = Ranging(((1, 2),), pairs)
    work.run()
    assert not any(work.robots[1].readings.values())
    assert work.robots[1].tables is None
    assert not work.robots[1].saved
    assert pairs.written == 0


def test_a_reading_of_the_distance_before_does_not_count() -> None:
    pairs = FakePairs(2, noise=0)
    work = Ranging(((1, 2),), pairs)
    work.run()
    for mm in GAIN_DISTANCES_MM:
        (told,) = {(gains.low, gains.high) for gains in work.robots[1].readings[mm]}
        assert told == tuple(pairs.strength(0, mm))


def test_a_robot_that_does_not_save_is_not_called_saved() -> None:
    pairs = FakePairs(4)
    pairs.forgetful = {3}
    work = Ranging(PAIRS, pairs)
    work.run()
    assert {uid for uid, robot in work.robots.items() if robot.saved} == {1, 2, 4}


def test_what_a_robot_has_already_is_not_written_again() -> None:
    pairs = FakePairs(2, noise=0)
    Ranging(((1, 2),), pairs).run()
    assert pairs.written == 28
    again = Ranging(((1, 2),), pairs)
    again.run()
    assert pairs.written == 28
    assert again.robots[1].came_with == again.robots[1].tables
    assert all(robot.saved for robot in again.robots.values())


def test_an_erased_robot_came_with_no_tables() -> None:
    pairs = FakePairs(2)
    work = Ranging(((1, 2),), pairs)
    work.run()
    assert work.robots[1].came_with is None


@pytest.mark.parametrize("checks", [(), (36, 91)])
def test_checks_are_measured_and_no_table_is_made_of_them(checks: tuple[int, ...]) -> None:
    pairs = FakePairs(2)
    work = Ranging(((1, 2),), pairs)
    work.run(checks)
    assert pairs.placed == [*GAIN_DISTANCES_MM, *checks]
    for robot in work.robots.values():
        assert robot.checks.keys() == set(checks)
        assert robot.readings.keys() == set(GAIN_DISTANCES_MM)
