"""`kilotwin calibrate` with robots that are there, emulated or as a table without an engine."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from kilotwin.experiment.lab_file import read_lab

EXPERIMENT = """
name = "few"
duration_s = 10
[grid]
columns = 6
rows = 6
[swarm]
profile = "kilobot"
program = "firmware/blank.c"
size = 8
"""


def calibrate(*arguments: str | Path) -> dict[str, Any]:
    """The JSON of `kilotwin calibrate motors`; robots may fail."""
    command = [sys.executable, "-m", "kilotwin", "calibrate", "motors", "--json", "--quiet"]
    done = subprocess.run(
        [*command, *map(str, arguments)], capture_output=True, text=True, check=False
    )
    assert done.returncode in (0, 4), done.stderr
    result: dict[str, Any] = json.loads(done.stdout)
    assert (done.returncode == 4) == bool(result["failed"])
    return result


def test_emulated_robots_get_straighter_and_stand_in_the_lab(tmp_path: Path) -> None:
    file, lab = tmp_path / "few.toml", tmp_path / "lab.toml"
    file.write_text(EXPERIMENT)
    result = calibrate("--via", f"emulated:{file}", "--lab", lab, "--rounds", "2")
    true = result["true_bend_deg_m"]
    assert true["after"]["median"] < true["before"]["median"] / 2
    robots = read_lab(lab).robots
    saved = {robot["uid"]: robot for robot in result["robots"] if robot["result"] == "saved"}
    assert saved.keys() == robots.keys()
    assert len(saved) >= 5
    for uid, robot in robots.items():
        assert robot.straight_left == saved[uid]["straight_left"]
        assert robot.motors is not None


@pytest.mark.long
def test_fifty_robots_with_the_default_spreads_get_three_times_straighter(tmp_path: Path) -> None:
    """The median of how far a robot's heading turns in its first metre: 518, then 72 deg."""
    result = calibrate(
        *("--via", "emulated:experiments/calibration/fifty-robots.toml"),
        *("--lab", tmp_path / "lab.toml"),
    )
    true = result["true_bend_deg_m"]
    print(true)
    assert true["after"]["median"] < true["before"]["median"] / 3
    assert len(result["failed"]) <= 10
