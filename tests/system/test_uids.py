"""Robots have the uids that the experiment gives them, 0 too, and commands reach them by these."""

import json
from pathlib import Path

import pytest

from kilotwin import World

SEED = """\
#include <kilolib.h>
void setup(void) {}
void loop(void) { set_color(kilo_uid == 0 ? RGB(3, 0, 0) : RGB(0, 0, kilo_uid & 3)); }
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
EXPERIMENT = """
duration_s = 3
[arena]
diameter_m = 0.6
[swarm]
profile = "kilobot"
cpu = "{cpu}"
[[robots]]
program = "seed.c"
poses = "start_positions.json"
uids = [0, 2, 3]
[[command]]
at_s = 0
send = "run"
uid_first = 0
uid_last = 2
"""


@pytest.mark.parametrize("cpu", ["native", "translated", "avr"])
def test_the_robot_with_uid_0_finds_itself(cpu: str, tmp_path: Path) -> None:
    (tmp_path / "seed.c").write_text(SEED)
    robots = [
        {"ID": robot, "direction": 0.0, "x_position": 45.0 * robot, "y_position": 0.0}
        for robot in range(3)
    ]
    (tmp_path / "start_positions.json").write_text(json.dumps({"bot_positions": robots}))
    (tmp_path / "seed.toml").write_text(EXPERIMENT.format(cpu=cpu))
    with World(tmp_path / "seed.toml") as world:
        world.run(2)
        assert world.poses[:, 0].tolist() == pytest.approx([0, 0.045, 0.09])
        assert world.leds[:2].tolist() == [3, 2 << 4]
        assert world.leds[2] != 3 << 4  # RUN was not for it
