"""Keys of an experiment that hunts brought: clocks that have been on, faults that end, mistakes."""

from pathlib import Path

import pytest

from kilotwin import RGB
from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.causes import MISTAKES, is_mistake
from kilotwin.session.world import World
from kilotwin.studies.scenario.judge import judge
from kilotwin.studies.scenario.one_run import run_once, tasks_of

PROGRAM = """\
#include <kilolib.h>
static message_t out;
static volatile uint16_t heard, zero, share;
static volatile uint32_t began;
static message_t *tx(void) { return &out; }
static void rx(message_t *in, distance_measurement_t *d) { (void)in; (void)d; heard++; }
static void setup(void) {
    out.crc = message_crc(&out);
    began = kilo_ticks;
    set_color(began > 200 ? RGB(0, 1, 0) : RGB(0, 0, 1));
}
static void loop(void) {
    set_motors(kilo_straight_left, kilo_straight_right);
    if (DIVIDES && kilo_ticks > began + 30) share = 7 / zero;
}
int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
"""
EXPERIMENT = """\
duration_s = 40
[arena]
diameter_m = 2
[swarm]
profile = "kilobot"
{swarm}
[[robots]]
program = "keys.c"
define = ["DIVIDES={divides}"]
count = 2
poses = [[0, 0, 0], [0.05, 0, 0]]
[motion]
kick_needed = false
"""
TIERS = ("native", "translated")


def written(folder: Path, more: str = "", *, swarm: str = "", divides: int = 0) -> Path:
    (folder / "keys.c").write_text(PROGRAM)
    file = folder / "keys.toml"
    file.write_text(EXPERIMENT.format(swarm=swarm, divides=divides) + more)
    return file


@pytest.mark.parametrize("cpu", TIERS)
def test_robots_that_have_been_on_have_counted_as_many_ticks(tmp_path: Path, cpu: str) -> None:
    file = written(tmp_path)
    began = []
    for on_s in (0.0, 3000.0):
        with World(file, set=[f"swarm.cpu={cpu}", f"swarm.on_s={on_s}"]) as world:
            world.run(1)
            began.append(world.variable(0, "began"))
            assert world.events == []
    assert began[1] - began[0] == pytest.approx(3000 / 0.032768, abs=1)


@pytest.mark.parametrize(("on_s", "colour"), [(0.0, RGB(0, 0, 1)), (6.0, RGB(0, 1, 0))])
def test_chips_wait_for_as_long(tmp_path: Path, on_s: float, colour: int) -> None:
    with World(written(tmp_path), set=["swarm.cpu=avr", f"swarm.on_s={on_s}"]) as world:
        world.run(1)
        assert world.leds[0] == colour


def faults(kind: str, more: str = "") -> str:
    return f'[[faults.robot]]\nkind = "{kind}"\nat_s = 10\nfor_s = 10\nrobots = [1]\n{more}'


def heard(world: World, robot: int, seconds: float) -> int:
    before = world.variable(robot, "heard")
    world.run(seconds)
    return int(world.variable(robot, "heard") - before)


@pytest.mark.parametrize("cpu", TIERS)
@pytest.mark.parametrize(("kind", "whose"), [("deaf", 0), ("mute", 1)])
def test_a_robot_is_deaf_or_mute_for_a_while(
    tmp_path: Path, cpu: str, kind: str, whose: int
) -> None:
    file = written(tmp_path, faults(kind))
    with World(file, set=[f"swarm.cpu={cpu}"]) as world:
        counts = [heard(world, whose, 9)]
        world.run(2)
        counts.append(heard(world, whose, 8))
        world.run(2)
        counts.append(heard(world, whose, 9))
        texts = [event["text"] for event in world.events]
    assert counts[0] > 5
    assert counts[1] == 0
    assert counts[2] > 5
    assert texts == [kind, {"deaf": "receives again", "mute": "transmits again"}[kind]]


@pytest.mark.parametrize("kind", ["dead", "stuck"])
def test_others_do_not_recover(tmp_path: Path, kind: str) -> None:
    with pytest.raises(InputError, match=r"keys\.toml:\d+: only deaf and mute robots recover"):
        Experiment.load(written(tmp_path, faults(kind)))


@pytest.mark.parametrize(("wanted", "passes"), [("true", False), ("false", True)])
@pytest.mark.parametrize("cpu", ["native", "translated"])
def test_a_mistake_fails_a_scenario_that_asks_for_it(
    tmp_path: Path, wanted: str, passes: bool, cpu: str
) -> None:
    asks = f'[[expect]]\nno_mistake = {wanted}\n[[expect]]\nthat = "failed == 0"\n'
    file = written(tmp_path, asks, swarm=f'cpu = "{cpu}"', divides=1)
    experiment = Experiment.load(file)
    (task,) = tasks_of(experiment, 1, 60.0, lambda _: None)
    verdicts = judge(experiment, [run_once(task)])
    failed = [one for one in verdicts if not one.passed]
    assert (failed == []) == passes
    if not passes:
        assert failed[0].expected == "no_mistake = true"
        assert "divides by zero" in failed[0].said


def test_a_program_that_makes_no_mistake_meets_it(tmp_path: Path) -> None:
    experiment = Experiment.load(written(tmp_path, "[[expect]]\nno_mistake = true\n"))
    (task,) = tasks_of(experiment, 1, 60.0, lambda _: None)
    assert all(one.passed for one in judge(experiment, [run_once(task)]))


def test_the_engine_has_notes_of_all_mistakes() -> None:
    root = Path(__file__).parents[2] / "emulator/robots"
    sources = "".join(
        (root / name).read_text() for name in ("translated/mistakes.cpp", "native/fault.cpp")
    )
    told = " ".join(sources.replace('"\n', " ").replace('"', " ").split())
    for mistake in MISTAKES:
        begin = mistake.removeprefix("it reads").removeprefix("it writes").strip()
        assert begin in told, mistake
        assert is_mistake({"kind": "note", "text": mistake})
        assert is_mistake({"kind": "note", "text": f"at walk.c:3 in loop(): {mistake}"})
    assert not is_mistake({"kind": "note", "text": "BOOT leaves the robot idle"})
    assert not is_mistake({"kind": "print", "text": MISTAKES[0]})
