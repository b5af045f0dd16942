"""[[expect]] tables: what is refused, and that they are no part of an experiment's identity."""

import pytest

from kilotwin.errors import InputError

from ..conftest import SMALL, Load

METRIC = """
[states]
resting = "bright-white"
"far away" = "red"

[metric.near]
builtin = "share"
site = "black"
"""


@pytest.mark.parametrize(
    "keys",
    [
        'that = "resting.black >= 6 and near > 0.5"',
        """that = 'state.far_away + state["far away"] == 0'""",
        'that = "led.bright_red <= failed + not_resting + robots + site.white"\nat_s = 30',
        'that = "near"\nwithin_s = 20\nafter_s = 10',
        'that = "near"\nthroughout_s = 60',
        'share = "near > 0.5"\nat_least = 0.8\nruns = 50',
        "no_crash = false",
        "no_busy_wait = true\nruns = 3",
        "messages_per_robot_s = [0.5, 2.5]",
    ],
)
def test_what_is_expected_is_taken(keys: str, load: Load) -> None:
    loaded = load(f"{SMALL}{METRIC}[[expect]]\n{keys}\n")
    assert loaded.keys.expect[0].kind in keys
    again = load(loaded.to_toml())
    assert again.keys.expect == loaded.keys.expect


@pytest.mark.parametrize(
    ("keys", "line", "why"),
    [
        ('that = "resting.blck > 1"', 1, "did you mean 'resting.black'"),
        ('that = "rest > 1"', 1, "there are: near, time_s"),
        ('that = "near = 1"', 1, "for equal write =="),
        ("", 0, "says not what is expected; give it one of that"),
        ('that = "near"\nno_crash = true', 2, "has that and no_crash; give it one of them"),
        ('share = "near"', 1, "'share' needs at_least, at_most or both"),
        ('share = "near"\nat_least = 0.9\nat_most = 0.1', 2, "at_least is above at_most"),
        ('that = "near"\nat_least = 0.9', 2, "'that' has no 'at_least'"),
        ("no_crash = true\nat_s = 30", 2, "'no_crash' is about the whole run; remove 'at_s'"),
        ('that = "near"\nat_s = 10\nwithin_s = 10', 3, "has at_s and within_s"),
        ('that = "near"\nafter_s = 10', 2, "'after_s' goes with within_s or throughout_s"),
        ('that = "near"\nat_s = 61', 2, "looks at 61 s, and the run ends at 60 s"),
        ('that = "near"\nat_s = 4', 2, "4 s lies between the samples at 0 and 9.994 s"),
        ('that = "near"\nafter_s = 12\nwithin_s = 3', 3, "no sample lies between 12 and 15 s"),
        ("messages_per_robot_s = [3, 1]", 1, r"must be \[least, most\]"),
    ],
)
def test_what_cannot_be_expected_is_refused_with_its_line(
    keys: str, line: int, why: str, load: Load
) -> None:
    before = f"{SMALL}{METRIC}[[expect]]\n"
    with pytest.raises(InputError, match=why) as refused:
        load(f"{before}{keys}\n")
    assert f"small.toml:{before.count(chr(10)) + line}: " in str(refused.value)


def test_an_experiment_is_the_same_whatever_is_expected_of_it(load: Load) -> None:
    plain = load()
    expected = load(SMALL + '[[expect]]\nthat = "robots == 10"\n')
    assert expected.identity() == plain.identity()
    assert "expect" not in plain.resolved()


def test_a_run_that_set_made_short_may_end_before_what_is_expected(load: Load) -> None:
    load(SMALL + '[[expect]]\nthat = "robots == 10"\nat_s = 50\n', "duration_s=20")
