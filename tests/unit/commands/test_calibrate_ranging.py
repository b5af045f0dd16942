"""`kilotwin calibrate ranging`: what it takes, what it refuses, what it stores."""

import contextlib
import json
import os
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.unit.lab.fake_pairs import FakePairs
from typer.testing import CliRunner

from kilotwin.commands import calibrate, steps
from kilotwin.commands.calibrate import ranging
from kilotwin.errors import DeviceError, InputError, InterruptError
from kilotwin.experiment.lab_file import read_lab
from kilotwin.files.headers import GAIN_DISTANCES_MM

ON_GRID = ("--via", "grid", "--can", "virtual:a", "--size", "4x6")


@pytest.fixture
def robots(monkeypatch: pytest.MonkeyPatch) -> FakePairs:
    """The link that --via names: robots 1 and 2, 3 and 4 in pairs."""
    pairs = FakePairs(4)

    @contextlib.contextmanager
    def link(*_: object) -> Iterator[FakePairs]:
        yield pairs

    monkeypatch.setattr(ranging, "link_to_robots", link)
    return pairs


@pytest.fixture
def jig(tmp_path: Path, robots: FakePairs, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A command that writes down what it was called with; robots follow it."""
    script, log = tmp_path / "stage.sh", tmp_path / "stage.log"
    script.write_text(f'#!/bin/sh\necho $1 >> {log}\ntest "$1" -lt 100\n')
    script.chmod(0o755)
    ask = robots.ask

    def asked(*arguments: Any) -> Any:
        robots.mm = int(log.read_text().split()[-1])
        return ask(*arguments)

    monkeypatch.setattr(robots, "ask", asked)
    return script


def call(*arguments: str | Path) -> Any:
    """The command in this process: exit code, and JSON or text."""
    words = ["ranging", *map(str, arguments)]
    result = CliRunner().invoke(calibrate.app, words)
    if isinstance(result.exception, Exception):
        raise result.exception
    return result


def test_pairs_are_measured_where_a_command_brings_them(
    robots: FakePairs, jig: Path, tmp_path: Path
) -> None:
    lab = tmp_path / "lab.toml"
    words = ("--pairs", "1-2,3-4", "--jig", jig, "--lab", lab, "--check", "40,60", "--json")
    done = call(*ON_GRID, *words)
    assert done.exit_code == 0
    placed = [int(mm) for mm in (tmp_path / "stage.log").read_text().split()]
    assert placed == [*GAIN_DISTANCES_MM, 40, 60]
    result = json.loads(done.stdout)
    assert result["error_mm"]["measured"]["rms"] < result["error_mm"]["one_table"]["rms"]
    assert "came_with" not in result["error_mm"], "their EEPROMs were erased"
    known = read_lab(lab).robots
    for robot in result["robots"]:
        assert robot["result"] == "saved"
        assert known[robot["uid"]].low_gain == robot["low_gain"]
        measured = known[robot["uid"]].ranging
        assert measured is not None
        assert f"beside robot {robot['partner']}" in measured.how


def test_a_robot_that_does_not_save_is_not_in_the_lab(
    robots: FakePairs, jig: Path, tmp_path: Path
) -> None:
    robots.forgetful = {2}
    lab = tmp_path / "lab.toml"
    done = call(*ON_GRID, "--pairs", "1-2", "--jig", jig, "--lab", lab)
    assert done.exit_code == 4
    assert "failed: 2" in done.stdout
    assert read_lab(lab).robots.keys() == {1}


def test_a_jig_that_fails_ends_it_and_nothing_is_saved(
    robots: FakePairs, jig: Path, tmp_path: Path
) -> None:
    words = ("--pairs", "1-2", "--jig", jig, "--lab", tmp_path / "lab.toml")
    with pytest.raises(DeviceError, match=r"stage\.sh 110: exit code 1; nothing was saved"):
        call(*ON_GRID, *words, "--check", "110")
    assert robots.written == 0
    assert not (tmp_path / "lab.toml").exists()


def test_a_person_is_told_each_distance_and_may_leave(
    robots: FakePairs, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    master, slave = os.openpty()
    monkeypatch.setattr(sys, "stdin", os.fdopen(slave, "r", closefd=False))
    person = ranging._Person(robots, "grid", steps.Silent(), 14)
    for mm, key in ((33, b"?\n"), (38, b"\n")):
        threading.Timer(0.3, os.write, (master, key)).start()
        assert person.place(mm) is robots
    threading.Timer(0.3, os.write, (master, b"x")).start()
    with pytest.raises(InterruptError, match="nothing was saved"):
        person.place(43)
    said = capsys.readouterr().err
    assert "1 of 14: put the robots of each pair 33 mm apart, centre to centre: they touch" in said
    assert "2 of 14: put the robots of each pair 38 mm apart" in said
    for end in (master, slave):
        os.close(end)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((), "--pairs: name the robots that lie in pairs"),
        (("--pairs", "1,2"), "--pairs 1,2: '1' is no pair"),
        (("--pairs", "1-2-3"), "is no pair; write two uids as in 1-2"),
        (("--pairs", "1-2,2-3"), "robot 2 is in it twice"),
        (("--pairs", "1-1"), "robot 1 is in it twice"),
        (("--pairs", "1-65535"), "uids are 0 to 65534"),
        (("--pairs", "1-2", "--check", "40,x"), "--check 40,x: 'x' is no distance"),
        (("--pairs", "1-2", "--check", "30"), "whole mm from 33 to 120"),
        (("--pairs", "1-2", "--jig", "./no-such-jig"), "--jig ./no-such-jig: no such file"),
        (("--pairs", "1-2"), "--jig: this is no terminal; name a command"),
    ],
)
def test_what_cannot_be_is_refused(
    robots: FakePairs, tmp_path: Path, words: tuple[str, ...], says: str
) -> None:
    with pytest.raises(InputError, match=says):
        call(*ON_GRID, "--lab", tmp_path / "lab.toml", *words)
    assert robots.placed == []


def test_a_way_on_which_nothing_comes_back_is_refused(robots: FakePairs, tmp_path: Path) -> None:
    robots.verifies = False
    with pytest.raises(InputError, match="what robots read does not come back by it"):
        call("--via", "ohc:x", "--pairs", "1-2", "--lab", tmp_path / "lab.toml")


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ("size = 3", "pairs are made of an even number of robots; it has 3"),
        ('size = 2\n[medium]\nkind = "ideal"', "its robots are told distances"),
    ],
)
def test_an_experiment_without_pairs_is_refused(tmp_path: Path, keys: str, says: str) -> None:
    file = tmp_path / "few.toml"
    file.write_text(
        'duration_s = 10\narena = {diameter_m = 1}\n[swarm]\nprofile = "kilobot"\n'
        f'program = "firmware/blank.c"\n{keys}\n'
    )
    with pytest.raises(InputError, match=says):
        call("--via", f"emulated:{file}", "--lab", tmp_path / "lab.toml")


def test_emulated_robots_pair_by_themselves(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="pairs its robots by itself; leave it out"):
        call("--via", "emulated:a.toml", "--pairs", "1-2", "--lab", tmp_path / "lab.toml")
