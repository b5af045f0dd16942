"""`kilotwin calibrate`: what it takes, what it refuses, what it stores."""

import contextlib
import json
import os
import sys
import termios
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.unit.lab.fake_table import FakeTable
from typer.testing import CliRunner

from kilotwin.commands import calibrate
from kilotwin.commands.calibrate import motors, uid
from kilotwin.errors import DeviceError, InputError
from kilotwin.experiment.lab_file import read_lab
from kilotwin.table.lab.lab_store import lab_of

DEAF = 99
ON_GRID = ("--via", "grid", "--can", "virtual:a", "--size", "4x6")


@pytest.fixture
def table(monkeypatch: pytest.MonkeyPatch) -> FakeTable:
    """The link that --via names: robots 1 to 3."""
    table = FakeTable(4, 6, 3)
    table.hears = 1.0

    @contextlib.contextmanager
    def link(*_: object) -> Iterator[FakeTable]:
        yield table

    monkeypatch.setattr(motors, "WallClock", lambda: table)
    for module in (motors, uid):
        monkeypatch.setattr(module, "link_to_robots", link)
    return table


def call(*arguments: str | Path) -> Any:
    """The command in this process: exit code, and JSON or text."""
    result = CliRunner().invoke(calibrate.app, [str(argument) for argument in arguments])
    if isinstance(result.exception, Exception):
        raise result.exception
    return result


def test_duties_that_are_named_are_saved_and_kept(table: FakeTable, tmp_path: Path) -> None:
    lab = tmp_path / "lab.toml"
    sets = ("--set", "2:turn_left=61", "--set", "2:straight_right=72", "--set", "3:turn_right=62")
    done = call("motors", "--via", "grid", "--lab", lab, *sets, "--json")
    assert done.exit_code == 0
    assert tuple(table.saved[1]) == (61, 70, 65, 72)
    assert tuple(table.saved[2]) == (70, 62, 65, 65)
    assert tuple(table.saved[0]) == (255, 255, 255, 255)
    assert read_lab(lab).robots[2].straight_right == 72
    assert [robot["result"] for robot in json.loads(done.stdout)["robots"]] == ["saved", "saved"]


def test_a_robot_that_does_not_answer_is_not_in_the_lab(table: FakeTable, tmp_path: Path) -> None:
    lab = tmp_path / "lab.toml"
    done = call("motors", "--via", "grid", "--lab", lab, "--set", f"{DEAF}:turn_left=61", "--json")
    assert done.exit_code == 4
    assert json.loads(done.stdout)["failed"] == [DEAF]
    assert not lab.exists()


def test_what_cannot_be_verified_is_said(table: FakeTable, tmp_path: Path) -> None:
    table.verifies = False
    done = call(
        *("motors", "--via", "ohc:x", "--lab", tmp_path / "lab.toml"), "--set", "2:turn_left=61"
    )
    assert done.exit_code == 0
    assert "sent, not verifiable" in done.stdout


@pytest.mark.parametrize(
    ("written", "says"),
    [
        ("2:turn_lef=61", "--set 2:turn_lef=61: not of the form 12:turn_left=65; duties are"),
        ("turn_left=61", "not of the form"),
        ("2:turn_left=256", "uids are 0 to 65535, duties 0 to 255"),
        ("65536:turn_left=6", "uids are 0 to 65535, duties 0 to 255"),
    ],
)
def test_a_setting_that_cannot_be_is_refused(
    table: FakeTable, tmp_path: Path, written: str, says: str
) -> None:
    with pytest.raises(InputError, match=says):
        call("motors", "--via", "grid", "--lab", tmp_path / "lab.toml", "--set", written)
    assert table.now == 0


def test_on_a_grid_all_that_answer_are_calibrated(table: FakeTable, tmp_path: Path) -> None:
    lab = tmp_path / "lab.toml"
    done = call("motors", *ON_GRID, "--lab", lab, "--rounds", "2")
    assert "robots are in" in done.stdout
    assert set(read_lab(lab).robots) <= {1, 2, 3}
    assert len(read_lab(lab).robots) >= 2


def test_a_grid_on_which_no_robot_answers_is_an_error(table: FakeTable, tmp_path: Path) -> None:
    table.hears = 0.0
    with pytest.raises(DeviceError, match="no robot answers"):
        call("motors", *ON_GRID, "--lab", tmp_path / "lab.toml")


def test_by_hand_it_is_one_robot_on_a_terminal(table: FakeTable, tmp_path: Path) -> None:
    table.verifies = False
    lab = tmp_path / "lab.toml"
    with pytest.raises(InputError, match="one robot at a time"):
        call("motors", "--via", "ohc:x", "--lab", lab, "--uids", "1-2")
    with pytest.raises(InputError, match="this is no terminal"):
        call("motors", "--via", "ohc:x", "--lab", lab, "--uids", "1")


def test_keys_move_a_robot_and_save_it(
    table: FakeTable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table.verifies = False
    master, slave = os.openpty()
    monkeypatch.setattr(sys, "stdin", os.fdopen(slave, "r", closefd=False))
    typed = threading.Timer(0.5, os.write, (master, b"qqeS3x"))  # what comes before is flushed
    typed.start()
    result = motors._guided(
        table, tmp_path / "lab.toml", lab_of(tmp_path / "lab.toml"), frozenset({2}), "ohc:x"
    )
    assert result["failed"] == []
    assert tuple(table.saved[1]) == (72, 70, 66, 65)
    robot = read_lab(tmp_path / "lab.toml").robots[2]
    assert (robot.turn_left, robot.straight_left) == (72, 66)
    assert tuple(table.motors[1]) == (0, 0)
    assert termios.tcgetattr(slave)[3] & termios.ICANON
    for end in (master, slave):
        os.close(end)


def test_an_emulated_table_needs_a_grid(tmp_path: Path) -> None:
    file = tmp_path / "few.toml"
    file.write_text(
        'duration_s = 10\narena = {diameter_m = 1}\n[swarm]\nprofile = "kilobot"\n'
        'program = "firmware/blank.c"\nsize = 2\n'
    )
    with pytest.raises(InputError, match=r"few.toml: there is no grid"):
        call("motors", "--via", f"emulated:{file}", "--lab", tmp_path / "lab.toml")


def test_a_lab_with_mistakes_is_refused_before_anything_is_sent(
    table: FakeTable, tmp_path: Path
) -> None:
    lab = tmp_path / "lab.toml"
    lab.write_text("[robot.1]\nturn_left = 300\n")
    with pytest.raises(InputError, match=r"lab.toml:2"):
        call("motors", "--via", "grid", "--lab", lab, "--set", "2:turn_left=61")
    assert table.now == 0


def test_a_robot_gets_its_uid_and_keeps_its_duties(table: FakeTable, tmp_path: Path) -> None:
    lab = tmp_path / "lab.toml"
    lab.write_text("[robot.2]\nturn_left = 61\n")
    done = call("uid", "2", "40", "--via", "grid", "--lab", lab)
    assert done.exit_code == 0, done.output
    assert "robot 2 is 40: verified" in done.stdout
    assert read_lab(lab).robots[40].turn_left == 61
    assert tuple(table.saved[1]) == (61, 70, 65, 65)


def test_a_uid_that_another_robot_has_is_refused(table: FakeTable, tmp_path: Path) -> None:
    lab = tmp_path / "lab.toml"
    lab.write_text("[robot.2]\n\n[robot.40]\n")
    with pytest.raises(InputError, match=r"lab.toml:3: there is a robot 40 already"):
        call("uid", "2", "40", "--via", "grid", "--lab", lab)
    assert table.now == 0
