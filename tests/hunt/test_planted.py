"""Planted bugs: each is found, shrunk to at most three robots and 30 s, and fails each time."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from kilotwin.experiment.experiment import Experiment
from kilotwin.programs.native.sanitizer import SANITIZED
from kilotwin.studies.hunt.trial import outcome_of
from kilotwin.studies.pool.series import run_series
from kilotwin.studies.scenario.one_run import ran_of, tasks_of

PLANTED = Path(__file__).parent / "planted"
KILOTWIN = Path(sys.executable).with_name("kilotwin")
# A bug by its program, and the line it is to be found at or the expectation that shows it.
BUGS = {
    "torn_bytes": "led.red == 0",
    "torn_fields": "led.red == 0",
    "torn_element": "led.red == 0",
    "after_an_hour": "led.",
    "tick_modulo": "led.red == 0",
    "full_table": "no_busy_wait",
    "lost_wakeup": "led.yellow == 0",
    "rewritten": "led.red == 0",
    "half_written": "led.red == 0",
    "no_way_out": "led.yellow == 0",
    "small_ids": "no_",
    "nobody_near": "no_",
    "deep_stack": "no_",
}
QUICK = ("nobody_near", "small_ids", "full_table")
_TIMES = 100


def hunted(bug: str, folder: Path, *words: str) -> dict[str, object]:
    command = [KILOTWIN, "hunt", PLANTED / f"{bug}.toml", "--first", "--json", "-q"]
    done = subprocess.run(
        [*map(str, command), "--out", str(folder / "hunt"), *words],
        capture_output=True,
        text=True,
        cwd=folder,
        check=False,
    )
    assert done.returncode == 1, done.stderr + done.stdout
    (found,) = json.loads(done.stdout)["found"]
    return dict(found)


def fails_each_time(found: dict[str, object], times: int) -> None:
    is_sanitized = found["tier"] == "sanitized"
    experiment = Experiment.load(Path(str(found["scenario"])), [SANITIZED] if is_sanitized else [])
    (task,) = tasks_of(experiment, 1, 60.0, lambda _: None, sanitized=is_sanitized)
    answers = run_series([task] * times)
    outcomes = [outcome_of(experiment, ran_of(task, one), "plain") for one in answers]
    # An expectation of the whole run is written for a shorter one.
    wanted = str(found["expected"]).partition(",")[0]
    assert all(
        any(fault.expected.partition(",")[0] == wanted for fault in one.faults) for one in outcomes
    )
    assert len({one.result_hash for one in outcomes}) == 1


def assert_found(bug: str, found: dict[str, object]) -> None:
    assert BUGS[bug] in str(found["expected"])
    assert int(str(found["robots"])) <= 3
    assert float(str(found["duration_s"])) <= 30


@pytest.mark.parametrize("bug", QUICK)
def test_a_planted_bug_is_found_in_some_trials_and_fails_a_hundred_times(
    bug: str, tmp_path: Path
) -> None:
    found = hunted(bug, tmp_path, "--trials", "160", "-j", "1")
    assert_found(bug, found)
    fails_each_time(found, _TIMES)


@pytest.mark.long
@pytest.mark.parametrize("bug", BUGS)
def test_each_planted_bug_is_found_within_ten_minutes_on_two_cores(
    bug: str, tmp_path: Path
) -> None:
    found = hunted(bug, tmp_path, "--time", "600", "-j", "2")
    assert_found(bug, found)
    fails_each_time(found, _TIMES)
