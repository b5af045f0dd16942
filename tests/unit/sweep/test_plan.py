"""A sweep's file means every combination of its values, and says where it is wrong."""

from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import parse_setting
from kilotwin.studies.pool.places import Dask
from kilotwin.studies.sweep.plan import Plan, read_plan, shown


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


def test_a_trial_with_a_name_is_shown_without_its_lists(folder: Path) -> None:
    text = (
        "base = 'small.toml'\n[[together]]\nname = ['left', 'right']\nswarm.size = [3, 4]\n"
        "swarm.start_in_m = [[-1, -1, 1, 1], [-0.9, -0.9, 0.9, 0.9]]\n"
    )
    assert [shown(trial) for trial in plan_of(folder, text).trials] == [
        "small, left, swarm.size 3, seed 1",
        "small, right, swarm.size 4, seed 1",
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
        (
            "base = 'small.toml'\nvary.swarm.size = 5\n",
            "sweep.toml:2: vary.swarm.size is 5; it must",
        ),
        (
            "base = 'small.toml'\nvary.swarm.size = { from = 1, to = 5, stepp = 1 }\n",
            "sweep.toml:2: vary.swarm.size is {",
        ),
        (
            "base = 'small.toml'\nvary.swarm.size = { from = 1, to = 5, stepp = 1 }\n",
            "a range has no 'stepp'",
        ),
        (
            "base = 'small.toml'\nvary.duration_s = { from = nan, to = 5, step = 1 }\n",
            "sweep.toml:2: vary.duration_s is {'from': nan, 'to': 5, 'step': 1}; it must have",
        ),
        (
            "base = 'small.toml'\n[vary]\nswarm.size = [3,\n 5,\n -1]\n",
            "sweep.toml:5: swarm.size = -1: swarm.size is -1",
        ),
        (
            "base = 'small.toml'\n[[together]]\n",
            "sweep.toml:2: together.0 is {}; it must have lists",
        ),
        (
            "base = 'small.toml'\n[slurm]\njobs = 0\n",
            "sweep.toml:3: slurm.jobs is 0; it must be from 1",
        ),
        ("base = 'small.toml'\n[slurm]\njobs = 2.5\n", "slurm.jobs is 2.5; it must be a whole"),
        ("base = 'small.toml'\n[slurm]\nmemory = 'lots'\n", 'slurm.memory is "lots"; it must be'),
        ("base = 'small.toml'\n[slurm]\nwalltime = 'long'\n", 'slurm.walltime is "long"; it must'),
        ("base = 'small.toml'\n[slurm]\nwalltime = 3\n", "slurm.walltime is 3; it must be text"),
        ("\ufeffbase = 'small.toml'\n", "sweep.toml:1: begins with a byte order mark (BOM)"),
        ("base = 'small.toml'\nvary.swarm.size = []\n", "vary.swarm.size"),
        (
            "base = 'small.toml'\n[[together]]\nswarm.size = [1, 2]\nduration_s = [3]\n",
            "sweep.toml:4: lists of different lengths (swarm.size has 2, duration_s has 1)",
        ),
        (
            "base = 'small.toml'\n[[block]]\nbase = 'small.toml'\n",
            "sweep.toml:1: 'base' stands beside [[block]]",
        ),
        ("base = 'small.toml'\nset.swarm.sise = 5\n", "sweep.toml:2: swarm.sise = 5: unknown key"),
        ("base = 'small.toml'\nset.duration_s = -5\n", "sweep.toml:2: duration_s = -5: duration_s"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(folder: Path, text: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        plan_of(folder, text)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("vary.swarm.size = [3, 3]\n", "sweep.toml:2: means trials that the sweep has already"),
        ("vary.swarm.size = [3,\n5,\n3]\n", "sweep.toml:4: means trials"),
        ("each.swarm.size = [5, 10]\n", "sweep.toml:2: means trials"),
        ("set.swarm.size = 5\nvary.swarm.size = [3]\n", "sweep.toml:3: swarm.size is given at"),
        (
            "vary.swarm.size = [3]\neach.swarm.size = [5]\n",
            "sweep.toml:3: swarm.size is given at",
        ),
        (
            "vary.swarm.size = [3]\n[[together]]\nswarm.size = [5]\n",
            "sweep.toml:2: swarm.size is given at",
        ),
        (
            "vary.seed = [5, 6]\n",
            "sweep.toml:2: a sweep does not take 'seed'; write seeds = 3",
        ),
        ("set.seed = 5\n", "sweep.toml:2: a sweep does not take 'seed'"),
        ("each.seed = [5]\n", "sweep.toml:2: a sweep does not take 'seed'"),
        ("[[together]]\nseed = [5]\n", "sweep.toml:3: a sweep does not take 'seed'"),
        ("vary.robots = [[], [{}]]\n", "sweep.toml:2: 'robots' cannot vary as a whole"),
    ],
)
def test_no_trial_is_meant_twice_and_no_key_given_twice(folder: Path, text: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        plan_of(folder, "base = 'small.toml'\n" + text)
    assert says in str(caught.value)


def test_the_same_base_twice_is_refused(folder: Path) -> None:
    with pytest.raises(InputError, match=r"sweep.toml:2: means trials"):
        plan_of(folder, "base = ['small.toml',\n'small.toml']\n")


def test_bases_of_one_name_in_two_folders_are_told_apart(folder: Path) -> None:
    small = (folder / "small.toml").read_text()
    for lab in ("a", "b"):
        (folder / lab).mkdir()
        (folder / lab / "mine.toml").write_text(small)
        (folder / lab / "blink.c").write_text((folder / "blink.c").read_text())
    (folder / "b/mine.toml").write_text(small.replace("duration_s = 60", "duration_s = 30"))
    plan = plan_of(folder, "base = ['a/mine.toml', 'small.toml', 'b/mine.toml']\n")
    assert [trial.base for trial in plan.trials] == ["a/mine.toml", "small", "b/mine.toml"]
    assert shown(plan.trials[2]) == "b/mine.toml, seed 1"


def test_blocks_share_no_trial_and_override_nothing_that_all_have(folder: Path) -> None:
    block = "[[block]]\nbase = 'small.toml'\nseeds = 3\n"
    with pytest.raises(InputError, match=r"toml:4: means trials .* at .*toml:1 "):
        plan_of(folder, f"{block}{block}first_seed = 3\n")
    assert len(plan_of(folder, f"{block}{block}first_seed = 4\n").trials) == 6
    with pytest.raises(InputError, match=r"toml:5: swarm.size is given at .*toml:1 too"):
        plan_of(folder, f"set.swarm.size = 4\n{block}set.swarm.size = 5\n")


def test_what_is_set_can_be_gone_through_one_by_one_or_completed(folder: Path) -> None:
    text = "base = 'small.toml'\nset.swarm.size = 4\neach.swarm.size = [5]\n"
    assert [trial.experiment.size for trial in plan_of(folder, text).trials] == [4, 5]
    text = "base = 'small.toml'\nset.controller = {}\nvary.controller.beta = [1.5, 2.0]\n"
    assert len(plan_of(folder, text).trials) == 2


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("swarm.size=5", "--set swarm.size=5: the sweep varies swarm.size ("),
        ("swarm={}", "--set swarm={}: the sweep varies swarm.size ("),
        ("seed=9", "--set seed=9: a sweep does not take 'seed'; use --seeds"),
    ],
)
def test_the_command_line_sets_nothing_that_the_sweep_varies(
    folder: Path, setting: str, says: str
) -> None:
    with pytest.raises(InputError) as caught:
        plan_of(folder, "base = 'small.toml'\nvary.swarm.size = [3, 4]\n", setting)
    assert says in str(caught.value)
    with pytest.raises(InputError):
        plan_of(folder, "[[block]]\nbase = 'small.toml'\nset.swarm.size = 3\n", setting)


def test_too_many_trials_are_refused_before_they_are_made(folder: Path) -> None:
    text = (
        "base = 'small.toml'\nvary.swarm.size = { from = 1, to = 1000000, step = 1 }\nseeds = 2\n"
    )
    with pytest.raises(InputError, match="more than 1,000,000 trials"):
        plan_of(folder, text)
    with pytest.raises(InputError, match="more than 1,000,000 trials"):
        plan_of(folder, "base = 'small.toml'\n", seeds=99_999_999)


def test_seeds_of_one_combination_share_all_but_the_seed(folder: Path) -> None:
    """The base is read and checked once, not once per seed."""
    plan = plan_of(folder, "base = 'small.toml'\nseeds = 3\n")
    for trial in plan.trials:
        setting = parse_setting(f"seed={trial.seed}")
        alone = Experiment.load(folder / "small.toml", [setting])
        assert trial.experiment.identity() == alone.identity()


@pytest.mark.parametrize("address", ["nonsense", "127.0.0.1:abc", "foo://host:1", "tcp://host"])
def test_an_address_that_is_none_is_refused_at_once(address: str) -> None:
    with pytest.raises(InputError, match="not an address; try tcp://HOST:8786"):
        Dask(address)


def test_an_experiment_given_as_a_sweep_says_which_command_takes_it(folder: Path) -> None:
    with pytest.raises(InputError, match="an experiment, not a sweep; type: kilotwin run"):
        read_plan(folder / "small.toml")


def test_a_sweep_given_as_an_experiment_says_which_command_takes_it(folder: Path) -> None:
    (folder / "sweep.toml").write_text('base = "small.toml"\nseeds = 2\n')
    with pytest.raises(InputError, match="a sweep, not an experiment; type: kilotwin sweep"):
        Experiment.load(folder / "sweep.toml")
