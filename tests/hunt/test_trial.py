"""Trials of a hunt: what counts as broken, and what is hunted in an experiment."""

from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import ExperimentText, Setting
from kilotwin.studies.hunt.hunt import quarry
from kilotwin.studies.hunt.trial import outcome_of
from kilotwin.studies.scenario.looks import Failure, Look
from kilotwin.studies.scenario.one_run import Ran

TEXT = """\
duration_s = 10
[arena]
diameter_m = 0.5
[swarm]
profile = "kilobot"
program = "idle.c"
size = 2
[[expect]]
that = "led.red == 0"
[[expect]]
share = "led.red == 0"
at_least = 0.5
[[expect]]
that = "led.blue == 0"
runs = 3
"""
PROGRAM = """\
#include <kilolib.h>
static void setup(void) {}
static void loop(void) {}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "idle.c").write_text(PROGRAM)
    (tmp_path / "idle.toml").write_text(TEXT)
    return tmp_path / "idle.toml"


@pytest.fixture
def experiment(file: Path) -> Experiment:
    return quarry(file, []).experiment


GOOD = (Look(True, "fine"), Look(True, "fine"), None)
BAD = (Look(False, "led.red = 1 at 3 s"), Look(True, "fine"), None)
CRASHES = tuple(Failure(f"robot {n} (idle) at 1 s", "crash", "idle.c", 3) for n in (1, 2))
MISTAKE = Failure("robot 1 (idle) at 2 s", "note: it divides by zero", "idle.c", 4)


def test_shares_and_numbers_of_runs_are_left_out_and_mistakes_looked_for(file: Path) -> None:
    hunted = quarry(file, [])
    texts = [expect.text() for expect in hunted.experiment.keys.expect]
    assert texts == ['that = "led.red == 0"', 'that = "led.blue == 0"', "no_mistake = true"]
    off = quarry(file, [Setting(("hunt", "mistakes"), False, "")])
    assert len(off.experiment.keys.expect) == 2
    assert (hunted.base.uids, hunted.base.counts) == ((1, 2), (2,))


def test_an_experiment_without_expectations_is_hunted_for_crashes(file: Path) -> None:
    file.write_text(TEXT.partition("[[expect]]")[0] + "[hunt]\nmistakes = false\n")
    texts = [expect.text() for expect in quarry(file, []).experiment.keys.expect]
    assert texts == ["no_crash = true"]


def test_an_experiment_with_a_program_outside_is_refused(file: Path) -> None:
    (file.parent / "world.py").write_text("class World:\n    pass\n")
    file.write_text(TEXT + '[environment]\nprogram = "world.py:World"\n')
    with pytest.raises(InputError, match="hunt without it"):
        quarry(file, [])


def test_a_run_that_meets_all_has_no_faults(experiment: Experiment) -> None:
    ran = Ran(1, GOOD, marks=({64: 1, 70: 6},), led_changes=((0, 3),), starts=((0.12346, 1, 2),))
    outcome = outcome_of(experiment, ran, "plain")
    assert outcome.faults == ()
    assert outcome.reached == {(0, 64, 1), (0, 70, 2), (0, 70, 4), ("led", 0, 3)}
    assert outcome.starts == ((0.1235, 1, 2),)


def test_an_expectation_and_each_line_of_a_program_are_faults(experiment: Experiment) -> None:
    ran = Ran(1, BAD, crashes=CRASHES, mistakes=(MISTAKE,))
    outcome = outcome_of(experiment, ran, "plain")
    assert [one.key for one in outcome.faults] == [
        ("no_crash = true", "idle.c", 3),
        ("no_mistake = true", "idle.c", 4),
        ('that = "led.red == 0"', "", 0),
    ]
    assert outcome.shows(("no_crash = true", "idle.c", 3))
    assert not outcome.shows(("no_crash = true", "idle.c", 4))


def test_natively_crashes_and_undefined_behaviour_count_alone(experiment: Experiment) -> None:
    ran = Ran(1, BAD, crashes=CRASHES, undefined=(MISTAKE,), mistakes=(MISTAKE,))
    outcome = outcome_of(experiment, ran, "sanitized")
    assert [one.expected for one in outcome.faults] == ["no_crash = true", "no_undefined = true"]


@pytest.mark.parametrize(
    ("trouble", "timed_out", "breaks"),
    [
        ("time-out: stopped after 60 s", True, False),
        ("robots find no room", False, False),
        ("its process was ended by SIGSEGV", False, True),
        ("nothing went on in the engine for 60 s", False, True),
    ],
)
def test_only_what_a_program_may_have_done_is_a_fault_of_a_run_without_an_end(
    experiment: Experiment, trouble: str, timed_out: bool, breaks: bool
) -> None:
    outcome = outcome_of(experiment, Ran(1, trouble=trouble, timed_out=timed_out), "plain")
    assert bool(outcome.faults) == breaks
    assert bool(outcome.refused) != breaks


def test_a_hunt_of_an_experiment_is_no_part_of_what_it_is(file: Path) -> None:
    plain = Experiment.load(file)
    text = ExperimentText.read(file, [Setting(("hunt", "failing"), 0, "")])
    assert Experiment.of(text).identity() == plain.identity()
