"""Calibration: uids, duties and gain tables get into robots, and robots then do as they say."""

from collections.abc import Callable
from pathlib import Path
from statistics import median, stdev
from typing import Any

import pytest

from .conftest import Person, Words

BLINK = "firmware/examples/blink.c"
FREE_UID = 60000
FEWEST_FOR_TURNS = 8
Told = Callable[..., Any]


def test_31_a_robot_takes_another_uid_and_keeps_it(
    told: Told, can: Words, person: Person, tmp_path: Path
) -> None:
    """A uid is written into the EEPROM of the one robot that it is for, and holds without power."""
    lab = ["--lab", str(tmp_path / "lab.toml")]
    before = {robot["uid"] for robot in told("robots", "uid", "--via", "grid", *can)}
    uid = min(before)
    told("calibrate", "uid", str(uid), str(FREE_UID), "--via", "grid", *can, *lab)
    person("switch all robots off and on again; done?")
    after = {robot["uid"] for robot in told("robots", "uid", "--via", "grid", *can)}
    assert after == before - {uid} | {FREE_UID}
    told("calibrate", "uid", str(FREE_UID), str(uid), "--via", "grid", *can, *lab)


def test_32_duties_that_are_named_are_those_of_one_robot(
    told: Told, can: Words, person: Person, tmp_path: Path
) -> None:
    """CALIB with our mark moves, and is saved by, the robot of its uid alone."""
    uid = min(robot["uid"] for robot in told("robots", "uid", "--via", "grid", *can))
    person(
        f"look at the robots; exactly one of them is to stop blinking for a moment, {uid}; ready?"
    )
    words = ["--set", f"{uid}:turn_left=66", "--lab", str(tmp_path / "lab.toml")]
    done = told("calibrate", "motors", "--via", "grid", *can, *words)
    assert done["failed"] == []
    person("was it one robot?")


def test_33_robots_go_straight_by_what_was_measured(
    told: Told, can: Words, robots: int, tmp_path: Path
) -> None:
    """Cells show how robots bend: a second calibration finds them three times straighter."""
    words = ["--via", "grid", *can, "--no-turns", "--lab", str(tmp_path / "lab.toml")]
    first = told("calibrate", "motors", *words)
    second = told("calibrate", "motors", *words)
    assert len(first["robots"]) == robots
    bends = [
        median(abs(robot["bend_before_deg_m"]) for robot in done["robots"])
        for done in (first, second)
    ]
    assert bends[1] < bends[0] / 3


def test_34_robots_turn_alike_by_what_was_measured(
    told: Told, can: Words, robots: int, tmp_path: Path
) -> None:
    """Arcs show how strong motors are: a second calibration finds turns closer to each other."""
    if robots < FEWEST_FOR_TURNS:
        pytest.skip("needs --robots 8 or more")
    words = ["--via", "grid", *can, "--lab", str(tmp_path / "lab.toml")]
    spreads = [
        stdev(share for robot in done["robots"] for share in robot["turn_before_share"])
        for done in (told("calibrate", "motors", *words) for _ in range(2))
    ]
    assert spreads[1] < spreads[0] / 1.3


def test_35_robots_tell_distances_by_what_was_measured(
    told: Told, can: Words, person: Person, tmp_path: Path
) -> None:
    """Receivers tell what they read, tables get into EEPROMs, and give distances right to 3 mm."""
    uids = sorted(robot["uid"] for robot in told("robots", "uid", "--via", "grid", *can))[:2]
    pair = f"{uids[0]}-{uids[1]}"
    person(f"robots {pair} lie alone on the grid, with a ruler or a plate with holes; ready?")
    words = ["--pairs", pair, "--check", "40,60,75", "--lab", str(tmp_path / "lab.toml")]
    done = told("calibrate", "ranging", "--via", "grid", *can, *words)
    assert done["failed"] == []
    assert done["error_mm"]["measured"]["rms"] < 3


def test_36_a_power_cut_while_a_robot_saves_does_no_harm(
    told: Told, isp: Words, can: Words, person: Person, tmp_path: Path
) -> None:
    """The EEPROM's records: after a power cut duties and tables are all old or all new."""
    before = told("flash", "robot", BLINK, *isp, "--dry-run")
    person("put that robot on the grid; switch it off while it is saved to; ready?")
    words = ["--set", f"{before['uid']}:turn_left=61", "--set", f"{before['uid']}:turn_right=62"]
    lab = ["--lab", str(tmp_path / "lab.toml")]
    told("calibrate", "motors", "--via", "grid", *can, *words, *lab, expect=4)
    person("switch it on and off again, and put it on the programmer; done?")
    after = told("flash", "robot", BLINK, *isp, "--dry-run")["duties"]
    new = {**before["duties"], "turn_left": 61, "turn_right": 62}
    assert after in (before["duties"], new)
