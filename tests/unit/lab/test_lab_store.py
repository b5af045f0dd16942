"""The lab's file is written whole, and keeps what others wrote into it."""

from datetime import datetime
from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.table.lab import lab_store
from kilotwin.table.lab.lab_store import Entry, duties_of, lab_of, rename, store

NOW = datetime(2026, 11, 24, 12, 0, 0, 123456)
DUTIES = {"straight_left": 62, "straight_right": 80}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "lab.toml"


def test_a_new_file_has_what_was_measured(file: Path) -> None:
    lab = store(file, [Entry(12, DUTIES, "motors", "by itself, grid")], NOW)
    assert lab == lab_of(file)
    robot = lab.robots[12]
    assert (robot.straight_left, robot.straight_right) == (62, 80)
    assert robot.motors is not None
    assert (robot.motors.at, robot.motors.how) == (NOW.replace(microsecond=0), "by itself, grid")


def test_comments_other_robots_and_other_keys_stay(file: Path) -> None:
    file.write_text("# ours\n[robot.3]\nturn_left = 61 # sticks\n\n[robot.12]\nturn_right = 60\n")
    store(file, [Entry(12, DUTIES, "motors", "by hand")], NOW)
    text = file.read_text()
    assert text.startswith("# ours\n[robot.3]\nturn_left = 61 # sticks\n")
    robot = lab_of(file).robots[12]
    assert (robot.turn_right, robot.straight_left) == (60, 62)


def test_what_others_wrote_meanwhile_stays(file: Path) -> None:
    store(file, [Entry(1, DUTIES, "motors", "one")], NOW)
    store(file, [Entry(2, DUTIES, "motors", "two")], NOW)
    assert list(lab_of(file).robots) == [1, 2]


def test_a_file_with_mistakes_stays_as_it_is(file: Path) -> None:
    file.write_text("[robot.3]\nturn_left = 300\n")
    with pytest.raises(InputError, match=r"lab.toml:2: robot.3.turn_left is 300"):
        store(file, [Entry(12, DUTIES, "motors", "by hand")], NOW)
    assert file.read_text() == "[robot.3]\nturn_left = 300\n"


def test_a_value_out_of_range_is_not_written(file: Path) -> None:
    with pytest.raises(InputError, match="turn_left is 256"):
        store(file, [Entry(12, {"turn_left": 256}, "motors", "by hand")], NOW)
    assert not file.exists()


def test_a_folder_that_is_not_there_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file or directory; name a lab's file"):
        store(tmp_path / "none" / "lab.toml", [Entry(12, DUTIES, "motors", "by hand")], NOW)


def test_a_robot_keeps_its_values_under_its_new_uid(file: Path) -> None:
    store(file, [Entry(12, DUTIES, "motors", "by hand")], NOW)
    rename(file, 12, 40)
    lab = lab_of(file)
    assert list(lab.robots) == [40]
    assert lab.robots[40].straight_left == 62


def test_no_two_robots_get_one_uid(file: Path) -> None:
    for uid in (12, 40):
        store(file, [Entry(uid, DUTIES, "motors", "by hand")], NOW)
    with pytest.raises(InputError, match=r"lab.toml:6: there is a robot 40 already"):
        rename(file, 12, 40)


def test_duties_that_the_lab_does_not_know_are_the_usual_ones(file: Path) -> None:
    lab = store(file, [Entry(12, {"straight_left": 62}, "motors", "by hand")], NOW)
    usual = {"turn_left": 65, "straight_left": 70}
    assert duties_of(lab.robots[12], usual) == {"turn_left": 65, "straight_left": 62}
    assert duties_of(None, usual) == usual


def test_a_robot_in_a_line_of_its_own_is_asked_to_be_a_table(file: Path) -> None:
    file.write_text("robot = { 12 = { turn_left = 65 } }\n")
    lab = store(file, [Entry(12, DUTIES, "motors", "by hand")], NOW)
    assert lab.robots[12].straight_left == 62
    assert lab_store.lab_of(file) == lab
