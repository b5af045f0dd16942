"""Scenarios: runs of experiments with [[expect]], and verdicts on them, with the real engine."""

import json
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from math import comb
from pathlib import Path

import pytest

from kilotwin.commands.terminal import SweepSilent
from kilotwin.errors import InputError, InterruptError
from kilotwin.experiment.experiment import Experiment
from kilotwin.studies.compare.plain_intervals import share_interval
from kilotwin.studies.pool.places import Processes
from kilotwin.studies.scenario.judge import ScenarioVerdict, judge, runs_of
from kilotwin.studies.scenario.looks import Failure, Look, once_per_cause
from kilotwin.studies.scenario.one_run import Ran, run_once, tasks_of
from kilotwin.studies.scenario.runner import find, prepare, run_all

TESTING = (Path(__file__).parents[3] / "docs" / "testing.md").read_text()

PROGRAM = """\
#include <kilolib.h>
static message_t out;
static uint8_t lucky;
static message_t *tx(void) { return SILENT && kilo_uid == 3 ? 0 : &out; }
static void setup(void) { out.crc = message_crc(&out); lucky = rand_hard() & 1; }
static void loop(void) {
    if (HANG) for (;;) lucky ^= 2;
    if (CRASH && kilo_uid == 2) *(volatile int *)0x123456789000 = 1;
    set_color(kilo_ticks < 500 ? RGB(0, 1, 0) : lucky ? RGB(3, 0, 0) : RGB(1, 0, 0));
}
int main(void) { kilo_init(); kilo_message_tx = tx; kilo_start(setup, loop); return 0; }
"""
TEXT = """\
duration_s = 25
arena.diameter_m = 0.5
swarm = {{ profile = "kilobot", cpu = "native" }}
record.sample_s = 1
[[robots]]
program = "program.c"
define = ["HANG={hang}", "CRASH={crash}", "SILENT={silent}"]
count = 4
"""
ALL_RED = "led.red + led.bright_red == robots"

Try = Callable[..., list[ScenarioVerdict]]


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """`scenario("that = ...", ..., hang=1)`: the file."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "program.c").write_text(PROGRAM)

    def write(*expects: str, name: str = "my.toml", hang: int = 0, crash: int = 0, silent: int = 0):  # type: ignore[no-untyped-def]
        text = TEXT.format(hang=hang, crash=crash, silent=silent)
        (tmp_path / name).write_text(text + "".join(f"[[expect]]\n{one}\n" for one in expects))
        return Path(name)

    return write


@pytest.fixture
def verdicts(scenario: Callable[..., Path]) -> Try:
    """`verdicts("that = ...", ..., hang=1)`: those on the scenario, after its runs."""

    def run(*expects: str, **faults: int) -> list[ScenarioVerdict]:
        experiment = Experiment.load(scenario(*expects, **faults))
        tasks = tasks_of(experiment, runs_of(experiment), 60, lambda _: None)
        return judge(experiment, [run_once(task) for task in tasks])

    return run


def test_conditions_are_looked_at_when_they_say(verdicts: Try) -> None:
    found = verdicts(
        'that = "led.green == 4"\nat_s = 10',
        f'that = "{ALL_RED}"',
        f'that = "{ALL_RED}"\nwithin_s = 10\nafter_s = 10',
        'that = "led.green == 4"\nthroughout_s = 10\nafter_s = 2',
        'that = "failed == 0 and time_s > 24"',
        "messages_per_robot_s = [1, 3]",
    )
    assert [one.passed for one in found] == [True] * 8
    assert found[2].said == "led.green = 4 at 10.22 s"


def test_what_is_not_met_says_what_was_seen_and_where_it_stands(verdicts: Try) -> None:
    found = verdicts(
        'that = "led.green == 4"',
        f'that = "{ALL_RED}"\nwithin_s = 5',
        'that = "led.green == 4"\nthroughout_s = 20\nafter_s = 1',
    )
    assert [one.passed for one in found] == [True, True, False, False, False]
    assert found[2].line().startswith('my.toml:9: that = "led.green == 4": led.green = 0 at 25.0')
    assert "led.red = 0, led.bright_red = 0, robots = 4 at 5" in found[3].said
    assert "led.green = 0 at 15.3" in found[4].said


def test_crashes_hangs_and_silent_robots_are_named_once_per_cause(verdicts: Try) -> None:
    crash, hang, *_ = verdicts('that = "robots == 4"', crash=1, hang=0)
    assert (crash.passed, hang.passed) == (False, True)
    assert "robot 2 (program) at" in crash.said
    assert "crash at program.c:8 in loop(): Segmentation fault" in crash.said
    (blamed,) = crash.blamed
    assert (Path(blamed.file).name, blamed.line) == ("program.c", 8)
    crash, hang, *_ = verdicts('that = "robots == 4"', hang=1)
    assert (crash.passed, hang.passed) == (True, False)
    assert "it has been busy for 10 s without coming back" in hang.said
    assert "(and 3 more like it)" in hang.said
    *_, silent = verdicts("messages_per_robot_s = [0.5, 3]", silent=1)
    assert silent.said == "robot 3 sent 0 messages/s (seed 1)"


def test_a_crash_that_is_expected_is_none_to_fail_at(verdicts: Try) -> None:
    found = verdicts("no_crash = false", 'that = "failed == 1"', crash=1)
    assert [(one.expected, one.passed) for one in found] == [
        ("no_busy_wait = true", True),
        ('that = "failed == 1"', True),
    ]


def test_a_share_is_judged_by_the_interval_of_its_runs(verdicts: Try) -> None:
    lucky = 'share = "led.bright_red >= 2"\nruns = 12\n'
    found = verdicts(lucky + "at_least = 0.5", lucky + "at_most = 0.2", lucky + "at_least = 0.99")
    assert [one.passed for one in found[2:]] == [True, False, False]
    assert "of 12 runs, a share of 0." in found[2].said
    assert "which is above 0.2" in found[3].said


def test_the_same_seed_gives_the_same_run(scenario: Callable[..., Path]) -> None:
    experiment = Experiment.load(scenario('that = "robots == 4"'))
    tasks = tasks_of(experiment, 2, 60, lambda _: None)
    first, other, again = (run_once(task) for task in (tasks[0], tasks[1], tasks[0]))
    assert first == again
    assert first.result_hash != other.result_hash


def test_a_run_that_takes_too_long_says_so(scenario: Callable[..., Path]) -> None:
    file = scenario('that = "robots == 4"')
    experiment = Experiment.load(file)
    (task,) = tasks_of(experiment, 1, 0.2, lambda _: None)
    long = replace(experiment, keys=experiment.keys.model_copy(update={"duration_s": 1e8}))
    ran = run_once(replace(task, experiment=long))
    assert ran.timed_out
    (verdict,) = judge(experiment, [ran])
    assert "time-out: stopped after 0.2 s" in verdict.line()


def test_a_failed_run_is_named_with_how_many_were_so(scenario: Callable[..., Path]) -> None:
    experiment = Experiment.load(scenario('that = "robots == 4"\nruns = 3'))
    good, bad = (Ran(n, (Look(n == 1, "robots = 3 at 25 s"),)) for n in (1, 2))
    *_, verdict = judge(experiment, [good, bad, replace(bad, seed=3)])
    assert verdict.said == "robots = 3 at 25 s (seed 2; so in 2 of 3 runs)"
    assert verdict.seed == 2


def test_causes_are_told_once_and_a_few_of_them() -> None:
    failures = [Failure(f"robot {n}", f"crash {n // 2}") for n in range(9)]
    places = [Failure(f"robot {n}", f"crash at address {n}", "a.c", n // 2) for n in range(4)]
    assert once_per_cause(places) == (
        "robot 0: crash at address 0 (and 1 more like it); "
        "robot 2: crash at address 2 (and 1 more like it)"
    )
    assert once_per_cause(failures) == (
        "robot 0: crash 0 (and 1 more like it); robot 2: crash 1 (and 1 more like it); "
        "robot 4: crash 2 (and 1 more like it); and 2 other causes"
    )


def test_files_are_found_below_a_folder_but_for_what_runs_leave(
    scenario: Callable[..., Path],
) -> None:
    kept = "failed/x/experiment.toml"  # of a run folder
    for name in ("b.toml", "runs/x/experiment.toml", kept, ".venv/a.toml", "deep/er/a.toml"):
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        scenario('that = "robots"', name=name)
    Path("failed/x/manifest.json").write_text("{}")
    Path("sweep.toml").write_text("seeds = 3\n")
    Path("broken.toml").write_text("expect = [[\n")
    assert find([]) == [Path("b.toml"), Path("deep/er/a.toml")]
    assert find([Path("deep"), Path("deep/er/a.toml")]) == [Path("deep/er/a.toml")]
    with pytest.raises(InputError, match=r"my.toml: has no \[\[expect\]\]"):
        prepare([scenario()], [], 1, lambda _: None)
    Path("empty").mkdir()
    with pytest.raises(InputError, match="empty: no experiment with"):
        find([Path("empty")])


@pytest.mark.parametrize(
    ("share", "runs"), re.findall(r"^\| (0\.\d) \| (\d+) \|$", TESTING, re.MULTILINE)
)
def test_so_many_runs_find_a_share_that_has_dropped_as_the_page_says(share: str, runs: str) -> None:
    true, first = float(share), int(runs)
    for number in range(first, first + 8):
        contradict = [hits for hits in range(number) if share_interval(hits, number).high < 0.8]
        ways = (
            comb(number, hits) * true**hits * (1 - true) ** (number - hits) for hits in contradict
        )
        assert sum(ways) >= 0.8


def test_an_interrupt_ends_it_with_a_line(
    scenario: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("kilotwin.studies.pool.pool.wait", interrupted)
    scenarios = prepare([scenario('that = "robots == 4"')], [], 60, lambda _: None)
    with pytest.raises(InterruptError, match="interrupted; scenarios without a row"):
        list(run_all(scenarios, Processes(1), SweepSilent()))


def test_the_command_has_a_row_for_each_scenario_junit_and_exit_codes(
    scenario: Callable[..., Path],
) -> None:
    scenario('that = "robots == 4"', name="good.toml")
    scenario('that = "led.green == 4"\nruns = 2', name="odd <name>.toml")

    def kilotwin(*words: str, expect: int) -> str:
        command = [sys.executable, "-m", "kilotwin", "test", "-j", "2", *words]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
        assert done.returncode == expect, done.stderr
        return done.stdout

    said = kilotwin("--junit", "out/report.xml", expect=1)
    assert "ok    good.toml" in said
    assert "FAIL  odd <name>.toml" in said
    assert "look at it: kilotwin view runs/failed/odd-name-seed1" in said
    assert Path("runs/failed/odd-name-seed1/map.png").exists()
    suites = {suite.get("name"): suite for suite in ET.parse("out/report.xml").getroot()}
    assert {name: suite.get("failures") for name, suite in suites.items()} == {
        "good.toml": "0",
        "odd <name>.toml": "1",
    }
    failed = suites["odd <name>.toml"].find("testcase[failure]")
    assert failed is not None
    assert failed.get("line") == "9"
    slow = ("good.toml", "--set", "duration_s=1e8", "--timeout", "0.3", "--json", "-q")
    (told,) = json.loads(kilotwin(*slow, expect=124))["scenarios"]
    assert told["timed_out"]
