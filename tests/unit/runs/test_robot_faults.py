"""[[faults.robot]]: robots that fail, alike however their programs are executed."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kilotwin import World
from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.robot_faults import robot_faults
from kilotwin.experiment.text import parse_setting

# It walks and says so; it is blue, or green for a second after it has received anything.
PROGRAM = """\
#include <kilolib.h>
static message_t hello;
static uint32_t heard_at;
static message_t *tx(void) { return &hello; }
static void rx(message_t *m, distance_measurement_t *d) { (void)m; (void)d; heard_at = kilo_ticks; }
static void setup(void) {
    hello.type = NORMAL;
    hello.crc = message_crc(&hello);
    spinup_motors();
    set_motors(kilo_straight_left, kilo_straight_right);
}
static void loop(void) {
    int fresh = heard_at != 0 && kilo_ticks - heard_at < 31;
    set_color(fresh ? RGB(0, 3, 0) : RGB(0, 0, 3));
}
int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
"""
TABLE = """\
duration_s = 20
seed = 3
arena = {{ shape = "rectangle", width_m = 1.0, height_m = 0.6 }}
record.sample_s = 1
{medium}
[swarm]
profile = "kilobot"
[motion]
speed_spread = 0
bias_spread = 0
motor_noise = 0
[[robots]]
program = "walk.c"
cpu = "{cpu}"
count = 4
poses = [[-0.4, 0.1, 0.0], [-0.4, 0.16, 0.0], [-0.4, -0.1, 0.0], [-0.4, -0.16, 0.0]]
"""
TIERS = ["native", "translated", "avr", "ideal"]
BLUE, GREEN = 3 << 4, 3 << 2


def fault(**keys: Any) -> str:
    """One table of [[faults.robot]]."""
    rows = "".join(f"{key} = {json.dumps(value)}\n" for key, value in keys.items())
    return f"\n[[faults.robot]]\n{rows}"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with walk.c."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "walk.c").write_text(PROGRAM)
    return tmp_path


def world(tier: str, *faults: str) -> World:
    """Two pairs of robots that walk side by side, far from each other."""
    ideal = tier == "ideal"
    cpu, medium = ("native", '"ideal"') if ideal else (tier, '"kilobot"')
    text = TABLE.format(cpu=cpu, medium=f"medium = {{ kind = {medium}, range_m = 0.1 }}")
    Path("my.toml").write_text(text + "".join(faults))
    return World("my.toml")


def told(of: World) -> list[tuple[int, str]]:
    """The uid and the kind of each fault."""
    return [(event["uid"], event["text"]) for event in of.events if event["kind"] == "fault"]


@pytest.mark.parametrize("tier", TIERS)
def test_a_dead_robot_stands_dark_and_is_silent(tier: str) -> None:
    with world(tier, fault(kind="dead", at_s=5, robots=[2])) as swarm:
        swarm.run(4.5)
        assert list(swarm.leds) == [GREEN] * 4
        swarm.run(2)
        before = swarm.poses
        sent = swarm.frames[:, 0].copy()
        swarm.run(5)
        moved = np.hypot(*(swarm.poses - before)[:, :2].T)
        assert moved[1] == 0
        assert (moved[[0, 2, 3]] > 0.03).all()
        assert list(swarm.leds) == [BLUE, 0, GREEN, GREEN]
        assert told(swarm) == [(2, "dead")]
        assert swarm.frames[1, 0] == sent[1]
        assert (swarm.frames[[0, 2, 3], 0] > sent[[0, 2, 3]]).all()


@pytest.mark.parametrize("tier", TIERS)
def test_a_stuck_robot_stands_and_goes_on_talking(tier: str) -> None:
    with world(tier, fault(kind="stuck", at_s=3, robots=[1])) as swarm:
        swarm.run(4)
        before = swarm.poses
        swarm.run(3)
        moved = np.hypot(*(swarm.poses - before)[:, :2].T)
        assert moved[0] == 0
        assert (moved[1:] > 0.02).all()
        assert list(swarm.leds) == [GREEN] * 4
        assert told(swarm) == [(1, "stuck")]


@pytest.mark.parametrize("tier", TIERS)
def test_a_deaf_robot_receives_nothing_and_is_received(tier: str) -> None:
    with world(tier, fault(kind="deaf", at_s=3, robots=[1])) as swarm:
        swarm.run(6)
        assert list(swarm.leds) == [BLUE, GREEN, GREEN, GREEN]


@pytest.mark.parametrize("tier", TIERS)
def test_a_mute_robot_receives_and_is_not_received(tier: str) -> None:
    with world(tier, fault(kind="mute", at_s=3, robots=[1])) as swarm:
        swarm.run(6)
        assert list(swarm.leds) == [GREEN, BLUE, GREEN, GREEN]


@pytest.mark.parametrize("tier", TIERS[:3])
def test_a_robot_that_drifts_walks_in_a_bend(tier: str) -> None:
    with world(tier, fault(kind="drift", at_s=3, robots=[4], left=0.8)) as swarm:
        swarm.run(8)
        headings = swarm.poses[:, 2]
        assert np.allclose(headings[:3], 0, atol=1e-6)
        assert abs(headings[3]) > 0.1


def test_others_draw_what_they_draw_without_the_fault() -> None:
    hashes = []
    for faults in ("", fault(kind="dead", at_s=3, probability=0)):
        with world("translated", faults) as swarm:
            swarm.run(10)
            hashes.append(swarm.result_hash)
            assert not told(swarm)
    assert hashes[0] == hashes[1]


def drawn(*settings: str, table: str = "") -> dict[int, int]:
    """Tick by index of the robots that fail."""
    text = 'swarm.profile = "kilobot"\nswarm.program = "walk.c"\nswarm.size = 40\n'
    Path("many.toml").write_text(f"duration_s = 100\narena.diameter_m = 1\n{text}{table}")
    experiment = Experiment.load(Path("many.toml"), [parse_setting(one) for one in settings])
    return {robot: tick for tick, robot, *_ in robot_faults(experiment)}


def test_a_larger_share_keeps_those_of_a_smaller_one() -> None:
    table = fault(kind="mute", at_s=10, until_s=50, share=0.25)
    few = drawn(table=table)
    more = drawn("faults.robot.0.share=0.5", table=table)
    assert (len(few), len(more)) == (10, 20)
    assert few.items() <= more.items()
    assert all(305 <= tick <= 1526 for tick in more.values())
    assert drawn("seed=2", table=table) != few


def test_a_larger_probability_keeps_those_of_a_smaller_one() -> None:
    table = fault(kind="dead", at_s=10, probability=0.3)
    few = drawn(table=table)
    more = drawn("faults.robot.0.probability=0.6", table=table)
    assert 5 < len(few) < len(more) < 35
    assert few.items() <= more.items()
    assert len(drawn("faults.robot.0.probability=1", table=table)) == 40


@pytest.mark.parametrize(
    ("table", "what"),
    [
        (fault(kind="dead", at_s=1, robots=[50]), "there is no robot 50; the robots are 1 to 40"),
        (fault(kind="dead", at_s=1, robots=[5], share=0.5), "keep one of them"),
        (fault(kind="dead", at_s=200), "never comes"),
        (fault(kind="dead", at_s=9, until_s=3), "3 s is before 9 s"),
        (fault(kind="drift", at_s=1), "needs left = ..., right = ... or both"),
        (fault(kind="stuck", at_s=1, left=0.5), "'left' goes with kind = \"drift\""),
        (fault(kind="tired", at_s=1), "dead"),
    ],
)
def test_a_mistake_is_named_with_what_to_do(table: str, what: str) -> None:
    with pytest.raises(InputError, match=r"many\.toml:\d+: ") as caught:
        drawn(table=table)
    assert what in str(caught.value)
