"""A batch of trials from Python gives what single worlds give, and says why a trial has failed."""

import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kilotwin import Trials, World
from kilotwin.errors import InputError

ROOT = Path(__file__).resolve().parents[3]
PROGRAM = """\
#include <kilolib.h>
static void setup(void) { set_color(RGB(1, 0, 0)); }
static void loop(void) {
    if (SPEED > 90 && kilo_uid == 2) *(volatile int *)0 = 1;
    set_motors(SPEED, kilo_turn_right);
}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
TEXT = """\
duration_s = 8
arena.diameter_m = 1.0
swarm = { profile = "kilobot", cpu = "native" }
[[robots]]
program = "program.c"
define = ["SPEED=60"]
count = 3
[metric.spread]
builtin = "spread"
when = "end"
[metric.first]
builtin = "first_time"
metric = "spread"
at_least = 100
[metric.apart]
builtin = "mean_distance"
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "program.c").write_text(PROGRAM)
    (tmp_path / "my.toml").write_text(TEXT)
    return tmp_path / "my.toml"


@pytest.fixture
def trials(file: Path) -> Iterator[Trials]:
    with Trials(file, metrics=["spread", "apart", "not_resting"], workers=2) as made:
        yield made


def of_world(file: Path, **settings: Any) -> list[float]:
    """The end of a world as it shows."""
    with World(file, set=[f"{key}={value}" for key, value in settings.items()]) as world:
        world.run(8)
        return [world.metrics[name] or np.nan for name in ("spread", "apart")]


def test_a_generation_equals_single_worlds(trials: Trials, file: Path) -> None:
    seeds = np.arange(6)
    values = trials([{"seed": seed, "motion.bias_spread": seed / 50} for seed in seeds])
    assert values.shape == (6, 3)
    assert trials.reasons == [""] * 6
    for seed, row in zip(seeds, values, strict=True):
        assert row[:2].tolist() == of_world(file, seed=seed, **{"motion.bias_spread": seed / 50})
    assert (values[:, 2] == 3).all()
    assert np.array_equal(trials([{"seed": 5, "motion.bias_spread": 0.1}]), values[5:])


def test_poses_are_given_as_an_array(trials: Trials) -> None:
    poses = np.array([[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]])
    ((near, _, _), (far, _, _)) = trials(
        [{"poses": poses * scale, "robots.0.define": ["SPEED=0"]} for scale in (1, 2)]
    )
    assert far == pytest.approx(2 * near)


def test_a_trial_that_fails_is_nan_with_its_reason_and_the_others_go_on(trials: Trials) -> None:
    values = trials([{}, {"robots.0.define": ["SPEED=99"]}, {"seed": 2}])
    assert np.isnan(values[1]).all()
    assert np.isfinite(values[[0, 2]]).all()
    assert [bool(reason) for reason in trials.reasons] == [False, True, False]
    assert "crash at program.c:4 in loop()" in trials.reasons[1]


def test_a_metric_without_a_value_is_nan_and_no_failure(file: Path) -> None:
    with Trials(file, workers=1) as trials:
        assert trials.metrics == ("spread", "first", "apart")
        ((spread, first, _),) = trials([{}])
    assert np.isfinite(spread)
    assert np.isnan(first)
    assert trials.reasons == [""]


def test_a_batch_of_none_is_an_array_of_none(trials: Trials) -> None:
    assert trials([]).shape == (0, 3)


@pytest.mark.parametrize(
    ("given", "what"),
    [
        ({"swarm.speed": 3}, "Trials: set 1: swarm.speed = 3: "),
        ({"duration_s": -1}, "Trials: set 1: duration_s = -1: "),
        ({"poses": [[5, 5, 0]] * 3}, "Trials: set 1: poses = "),
    ],
)
def test_a_set_that_is_no_experiment_is_named_before_any_is_run(
    given: dict[str, Any], what: str, trials: Trials, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trials._pool, "answers", lambda _: pytest.fail("one is run"))
    with pytest.raises(InputError, match=what):
        trials([{}, given])


@pytest.mark.parametrize(
    ("how", "what"),
    [
        ({"metrics": ["hops"]}, "has no metric 'hops'; it has spread, first, apart, not_resting"),
        ({"workers": 0}, "workers is 0; it must be 1 or more"),
        ({"trial_timeout_s": 0}, "trial_timeout_s is 0; it must be above 0"),
        ({"program": "program.c"}, "'program' goes without a file"),
    ],
)
def test_what_cannot_be_used_is_said_at_once(how: dict[str, Any], what: str, file: Path) -> None:
    with pytest.raises(InputError, match=what):
        Trials(file, **how)


def test_without_a_file_they_are_of_the_keys_of_a_world(file: Path) -> None:
    keys: dict[str, Any] = {
        "program": str(file.parent / "program.c"),
        "define": ["SPEED=60"],
        "count": 3,
        "cpu": "native",
        "metric": {"spread": {"builtin": "spread", "when": "end"}},
    }
    with pytest.raises(InputError, match="how long is a trial"):
        Trials(**keys)
    with Trials(duration_s=8, workers=1, **keys) as trials, World(seed=4, **keys) as world:
        world.run(8)
        assert trials([{"seed": 4}]).tolist() == [[world.metrics["spread"]]]


def test_a_script_without_a_guard_is_not_executed_by_its_workers(file: Path) -> None:
    script = file.with_name("script.py")
    script.write_text(
        textwrap.dedent("""\
        from kilotwin import Trials

        print("begin")
        with Trials("my.toml", metrics=["spread"], workers=2) as trials:
            print(trials([{"seed": 1}, {"seed": 2}]).shape)
        """)
    )
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, check=False, timeout=600
    )
    assert (done.returncode, done.stdout) == (0, "begin\n(2, 1)\n"), done.stderr
