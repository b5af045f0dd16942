"""A run says when its samples are farther apart than what its programs do."""

import numpy as np
import pytest

from kilotwin.runs.folder import add_to_manifest
from kilotwin.runs.reader import Run
from kilotwin.runs.sampling import DECISION_S, coarseness, decision_s
from kilotwin.view.served_run import ServedRun

from ..known_run import Begin


def decided(*each: int) -> np.ndarray:
    return np.array(each, dtype=np.uint32)


def test_the_program_that_decides_most_often_counts_by_its_median_robot() -> None:
    assert decision_s(decided(0, 0, 0, 10, 12, 900), [3, 3], 60) == 5
    assert decision_s(decided(7), [1], 70) == 10
    assert decision_s(decided(0, 0), [2], 60) is None
    assert decision_s(decided(), [], 60) is None


@pytest.fixture
def run(begin: Begin) -> Run:
    """Sampled each 10 s, of robots that change their LED each 1.5 s."""
    writer = begin("run", "record.sample_s=10")
    writer.close(clean=True)
    add_to_manifest(writer.folder, {"summary": {DECISION_S: 1.5}})
    return Run.open(writer.folder)


def test_a_run_that_is_sampled_too_seldom_says_so_and_what_to_type(run: Run) -> None:
    said = coarseness(run)
    assert said == (
        "colours and places are known each 10 s only, and robots change LED or motors each 1.5 s; "
        "--set record.sample_s=1 shows more"
    )
    assert ServedRun(run).state()["coarse"] == said
    assert coarseness(run, frame_s=40) == ""  # frames that are farther apart hide more


def test_a_run_that_is_sampled_often_enough_says_nothing(begin: Begin) -> None:
    writer = begin("run", "record.sample_s=1")
    writer.close(clean=True)
    assert coarseness(Run.open(writer.folder)) == ""
    add_to_manifest(writer.folder, {"summary": {DECISION_S: 1.5}})
    assert coarseness(Run.open(writer.folder)) == ""
    add_to_manifest(writer.folder, {"summary": {DECISION_S: None}})
    assert coarseness(Run.open(writer.folder)) == ""
