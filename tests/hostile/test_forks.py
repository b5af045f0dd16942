"""All programs of attacks.c again where worlds are forked: in the pool, and at a debugger's
checkpoints. Each is refused as in a run (test_attacks.py), and nothing outside is touched."""

from pathlib import Path

import pytest

from kilotwin.experiment.experiment import Experiment
from kilotwin.session.debug.repeated_run import Repeated, travel_in
from kilotwin.session.debug.travel import Wanted
from kilotwin.studies.scenario.one_run import run_once, tasks_of

from .test_attacks import ATTACKS, CALLS, EXPERIMENT, HERE, ROOT, STOPPED

HELD = """\
[[robots]]
program = "{root}/firmware/blank.c"
cpu = "translated"
count = 1
"""
# A run's worker gets orders by its standard input; a fork has none there, so that reading ends.
READS_NOTHING = {"sleep_for_orders"}


@pytest.fixture(scope="module")
def experiment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An experiment with all attacks, and a robot that a debugger can hold."""
    folder = tmp_path_factory.mktemp("forks")
    (folder / "outside").mkdir()
    (folder / "outside/victim").write_text("mine")
    names = {"program": HERE / "attacks.c", "folder": folder, "here": HERE, "count": len(ATTACKS)}
    text = EXPERIMENT.format(**names, landlock=1) + HELD.format(root=ROOT)
    (folder / "swarm.toml").write_text(text)
    return folder / "swarm.toml"


def test_in_a_fork_of_the_pool_each_is_refused_or_goes_on_as_in_a_run(experiment: Path) -> None:
    (task,) = tasks_of(Experiment.load(experiment, []), 1, 240.0, lambda _: None)
    ran = run_once(task)
    assert ran.trouble == ""
    stopped = {int(one.who.split()[1]) - 1 for one in ran.crashes}
    assert {ATTACKS[robot] for robot in stopped} == {*CALLS, *STOPPED} - READS_NOTHING
    assert_untouched(experiment)


def test_at_checkpoints_of_a_debugger_each_fork_comes_to_the_same_end(experiment: Path) -> None:
    held = len(ATTACKS) + 4
    results = set()
    with travel_in(Repeated.of(experiment, []), [held]) as (travel, _):
        travel.start([held], 2.0)
        here = travel.now
        assert here is not None
        for _ in range(2):
            assert travel.go_on(Wanted()).why == "end"
            results.add(travel.result_hash())
            travel.go_to(here.place)
    assert len(results) == 1
    assert_untouched(experiment)


def assert_untouched(experiment: Path) -> None:
    """What lies beside the experiment is as it was."""
    outside = experiment.parent / "outside"
    assert [file.name for file in outside.iterdir()] == ["victim"]
    assert (outside / "victim").read_text() == "mine"
    beside = sorted(file.name for file in experiment.parent.iterdir())
    assert beside == ["outside", "swarm.toml"]
