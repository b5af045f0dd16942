"""[[step]]: light that changes during a run, the same in a run, a scenario and a World."""

from pathlib import Path

import numpy as np
import pytest

from kilotwin import World
from kilotwin.errors import InputError, RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.studies.scenario.judge import judge
from kilotwin.studies.scenario.one_run import run_once, tasks_of

from ..conftest import SMALL, Load

PROGRAM = """\
#include <kilolib.h>
static void setup(void) {}
static void loop(void) {
    int16_t light = get_ambientlight();
    set_color(light < 150 ? RGB(0, 0, 1) : light < 450 ? RGB(0, 1, 0) : RGB(1, 0, 0));
}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
EXPERIMENT = """\
duration_s = 20
arena.diameter_m = 0.3
swarm.profile = "kilobot"
swarm.program = "light.c"
swarm.size = 3
record.sample_s = 1
light.ambient = 100
[[step]]
at_s = 10
ambient = 600
[[step]]
at_s = 5
ambient = 300
"""
LAMP = """
[[light.source]]
at_m = [0.0, 0.0]
peak = 0
half_m = 10.0
[[step]]
at_s = 15
lamp = 0
peak = 500
[[step]]
at_s = 14
ambient = 0
"""
EXPECTED = """
[[expect]]
that = "led.blue == robots"
throughout_s = 3
after_s = 1
[[expect]]
that = "led.green == robots"
throughout_s = 4
after_s = 5.5
[[expect]]
that = "led.red == robots"
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with small.toml, and a program that shows the light it sees."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "light.c").write_text(PROGRAM)
    (tmp_path / "blink.c").write_text(PROGRAM)
    return tmp_path


def colours(text: str) -> list[str]:
    """The colours of all robots at 4, 9, 13, 14.8 and 19 s."""
    Path("my.toml").write_text(text)
    seen = []
    with World("my.toml") as world:
        for moment_s in (4, 9, 13, 14.8, 19):
            world.run(moment_s - world.time_s)
            (led,) = np.unique(world.leds)
            seen.append({16: "blue", 4: "green", 1: "red"}[int(led)])
    return seen


def test_the_ambient_light_changes_at_its_time(folder: Path) -> None:
    assert colours(EXPERIMENT) == ["blue", "green", "red", "red", "red"]


def test_a_lamp_is_switched_on_for_robots_that_stand_still(folder: Path) -> None:
    assert colours(EXPERIMENT + LAMP) == ["blue", "green", "red", "blue", "red"]


MOVED = """
[[step]]
at_s = 2
robot = 2
pose = [0.1, 0.05, 1.0]
"""


def test_a_robot_is_put_elsewhere_and_stays_there(folder: Path) -> None:
    Path("my.toml").write_text(EXPERIMENT + MOVED)
    with World("my.toml") as world:
        world.run(1)
        before = world.poses
        world.run(5)
        after = world.poses
    assert np.allclose(after[1], [0.1, 0.05, 1.0], atol=1e-4)
    assert np.array_equal(after[[0, 2]], before[[0, 2]])


def test_a_robot_without_room_ends_the_run_with_a_line(folder: Path) -> None:
    Path("my.toml").write_text(EXPERIMENT + MOVED + MOVED.replace("robot = 2", "robot = 3"))
    with World("my.toml") as world, pytest.raises(RunError, match=r"at 2 s: robot 3 has no room"):
        world.run(5)


def test_the_next_expect_looks_at_what_a_step_has_done(folder: Path) -> None:
    Path("my.toml").write_text(EXPERIMENT + EXPECTED)
    experiment = Experiment.load(Path("my.toml"))
    (task,) = tasks_of(experiment, 1, 60, lambda _: None)
    assert [one.line() for one in judge(experiment, [run_once(task)]) if not one.passed] == []


def test_a_run_does_not_depend_on_how_its_caller_cuts_it_up(folder: Path) -> None:
    Path("my.toml").write_text(EXPERIMENT)
    hashes = set()
    for pieces in ([20.0], [1.0] * 20, [4.9, 0.2, 14.9]):
        with World("my.toml") as world:
            for for_s in pieces:
                world.run(for_s)
            world.run_ticks(720 - world.tick)
            hashes.add(world.result_hash)
    assert len(hashes) == 1


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        ("ambient = 3\nlamp = 0\npeak = 3", "does two things; give it ambient, lamp and peak, or"),
        ("", "does nothing; give it ambient, lamp and peak, or"),
        ("lamp = 0", "'lamp' and 'peak' go together; add peak"),
        ("pose = [0, 0, 0]", "'pose' and 'robot' go together; add robot"),
        ("robot = 11\npose = [0, 0, 0]", "there is no robot 11; the robots are 1 to 10"),
        ("robot = 1\npose = [9, 0, 0]", "outside|not inside|arena"),
        ("lamp = 0\npeak = 3", r"there is no lamp 0; there is no \[\[light.source\]\]"),
    ],
)
def test_a_step_that_does_not_one_thing_is_refused(keys: str, why: str, load: Load) -> None:
    with pytest.raises(InputError, match=why):
        load(f"{SMALL}[[step]]\nat_s = 3\n{keys}\n")


def test_a_step_after_the_end_is_refused_and_none_is_no_part_of_the_identity(load: Load) -> None:
    step = "[[step]]\nat_s = 70\nambient = 3\n"
    with pytest.raises(InputError, match=r"a \[\[step\]\] at 70 s never comes"):
        load(SMALL + step)
    load(SMALL + step, "duration_s=60")
    assert "step" not in load().resolved()
    assert load().identity() != load(SMALL + step.replace("70", "7")).identity()
