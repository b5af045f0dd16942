"""A sweep's file means every combination of its values, and says where it is wrong."""

from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.experiment_text import parse_setting
from kilotwin.sweep.plan import Plan, read_plan, shown


def plan_of(folder: Path, text: str, *settings: str, seeds: int | None = None) -> Plan:
    (folder / "sweep.toml").write_text(text)
    return read_plan(folder / "sweep.toml", map(parse_setting, settings), seeds)


def test_every_combination_is_run_once_per_seed(folder: Path) -> None:
    plan = plan_of(
        folder,
        'base = "small.toml"\nseeds = 2\n[vary]\nswarm.size = [3, 5]\nduration_s = [60, 90, 120]\n',
    )
    sizes = [(t.experiment.size, t.experiment.keys.duration_s, t.seed) for t in plan.trials]
    assert sizes == [(n, d, s) for n in (3, 5) for d in (60, 90, 120) for s in (1, 2)]
    assert plan.varied == ["swarm.size", "duration_s"]
    assert plan.keys.name == "sweep"


def test_a_range_has_the_numbers_as_they_are_written(folder: Path) -> None:
    text = 'base = "small.toml"\n[vary]\nmedium.range_m = { from = 0.1, to = 0.5, step = 0.1 }\n'
    ranges = [trial.settings["medium.range_m"] for trial in plan_of(folder, text).trials]
    assert ranges == [0.1, 0.2, 0.3, 0.4, 0.5]


def test_a_range_of_whole_numbers_stays_whole(folder: Path) -> None:
    text = 'base = "small.toml"\n[vary]\nswarm.size = { from = 2, to = 9, step = 3 }\n'
    assert [trial.experiment.size for trial in plan_of(folder, text).trials] == [2, 5, 8]


def test_keys_that_stand_together_change_together(folder: Path) -> None:
    text = (
        'base = "small.toml"\n[set]\nswarm.informed = 0.5\ncontroller = {}\n'
        "[[together]]\n"
        "swarm.informed_for.black = [0.5, 0.8]\nswarm.informed_for.white = [0.5, 0.2]\n"
    )
    trials = plan_of(folder, text).trials
    shares = [trial.experiment.keys.swarm.informed_for for trial in trials]
    assert shares == [{"black": 0.5, "white": 0.5}, {"black": 0.8, "white": 0.2}]
    assert all(trial.experiment.keys.swarm.informed == 0.5 for trial in trials)


def test_keys_under_each_change_one_at_a_time(folder: Path) -> None:
    text = (
        'base = "small.toml"\n[vary]\nduration_s = [1, 2]\n'
        "[each]\nswarm.size = [4, 5]\nengine.step_ticks = [1]\n"
    )
    once = [{}, {"swarm.size": 4}, {"swarm.size": 5}, {"engine.step_ticks": 1}]
    assert [trial.settings for trial in plan_of(folder, text).trials] == [
        {"duration_s": duration_s, **alone} for duration_s in (1, 2) for alone in once
    ]


def test_blocks_follow_one_another_with_seeds_and_settings_of_their_own(folder: Path) -> None:
    text = (
        "seeds = 3\n[[block]]\nbase = 'small.toml'\n"
        "[[block]]\nbase = 'small.toml'\nseeds = 2\nfirst_seed = 10\nset.swarm.size = 4\n"
    )
    trials = plan_of(folder, text).trials
    assert [trial.seed for trial in trials] == [1, 2, 3, 10, 11]
    assert [trial.experiment.size for trial in trials] == [10, 10, 10, 4, 4]
    assert [trial.settings for trial in trials] == 3 * [{}] + 2 * [{"swarm.size": 4}]
    assert [trial.index for trial in trials] == list(range(5))


def test_what_is_set_on_the_command_line_wins(folder: Path) -> None:
    text = "base = 'small.toml'\nseeds = 9\nset.duration_s = 100\n"
    plan = plan_of(folder, text, "duration_s=70", seeds=1)
    assert [trial.experiment.keys.duration_s for trial in plan.trials] == [70]


def test_trials_are_run_seed_by_seed(folder: Path) -> None:
    text = "base = 'small.toml'\nseeds = 2\nvary.swarm.size = [3, 4]\n"
    order = plan_of(folder, text).in_running_order()
    assert [(trial.seed, trial.experiment.size) for trial in order] == [
        (1, 3),
        (1, 4),
        (2, 3),
        (2, 4),
    ]


def test_a_trial_is_shown_by_what_varies(folder: Path) -> None:
    plan = plan_of(folder, "base = 'small.toml'\nvary.swarm.size = [3]\n")
    assert shown(plan.trials[0]) == "small, swarm.size 3, seed 1"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("name = 'x'\n", "sweep.toml: no experiment to run; add base"),
        ("base = 'gone.toml'\n", "sweep.toml:1: gone.toml: no such file beside the sweep"),
        ("base = []\n", "base"),
        ("bases = 'small.toml'\n", "sweep.toml:1: unknown key 'bases'"),
        ("base = 'small.toml'\nseeds = 0\n", "sweep.toml:2: seeds is 0; it must be from 1"),
        (
            "base = 'small.toml'\n[vary]\nswarm.size = { from = 1, to = 5 }\n",
            "must be a list, or a range",
        ),
        (
            "base = 'small.toml'\n[vary]\nswarm.size = { from = 5, to = 1, step = 1 }\n",
            "a step above 0 that leads from `from` up to `to`",
        ),
        ("base = 'small.toml'\nvary.swarm.size = 5\n", "vary"),
        ("base = 'small.toml'\nvary.swarm.size = []\n", "vary.swarm.size"),
        (
            "base = 'small.toml'\n[[together]]\nseed = [1, 2]\nduration_s = [3]\n",
            "sweep.toml:2: lists of different lengths (seed has 2, duration_s has 1)",
        ),
        (
            "base = 'small.toml'\n[[block]]\nbase = 'small.toml'\n",
            "sweep.toml:1: 'base' stands beside [[block]]",
        ),
        ("base = 'small.toml'\nset.swarm.sise = 5\n", "sweep.toml: swarm.sise = 5: unknown key"),
        ("base = 'small.toml'\nset.duration_s = -5\n", "sweep.toml: duration_s = -5: duration_s"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(folder: Path, text: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        plan_of(folder, text)
    assert says in str(caught.value)
