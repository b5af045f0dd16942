"""Arenas and obstacles of any shape, with real programs."""

import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kilotwin import RGB, World
from kilotwin.errors import InputError
from kilotwin.experiment.areas import area_of, disc, lies_inside, overlap, polygon_of
from kilotwin.experiment.schema.experiment import Obstacle

from .conftest import WALKER, Program

CORNERS = [[-0.4, -0.3], [0.4, -0.3], [0.5, 0.3], [0.0, 0.05], [-0.4, 0.3]]
OBSTACLES: list[dict[str, Any]] = [
    {"centre_m": [-0.2, -0.05], "diameter_m": 0.1},
    {
        "shape": "rectangle",
        "centre_m": [0.15, -0.15],
        "width_m": 0.2,
        "height_m": 0.01,
        "heading_rad": 0.8,
    },
    {"shape": "polygon", "points_m": [[-0.4, -0.3], [-0.3, -0.3], [-0.4, -0.2]]},
]
TALKER = """\
#include <kilolib.h>
static message_t out;
static volatile uint8_t heard;
static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    heard = 1;
}
static message_t *send(void) { return &out; }
static void setup(void) { out.type = NORMAL; out.crc = message_crc(&out); }
static void loop(void) {
    set_color(heard ? RGB(0, 3, 0) : get_ambientlight() > 500 ? RGB(3, 0, 0) : RGB(0, 0, 0));
}
int main(void) {
    kilo_message_rx = on_message;
    kilo_message_tx = send;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
"""


RADIUS_M = 0.0165
ROOT = Path(__file__).parents[2]


def test_kilobots_keep_to_the_free_part_of_a_polygon(program: Program) -> None:
    keys: dict[str, Any] = {"arena": CORNERS, "obstacle": OBSTACLES, "seed": 3}
    with World(program=program(WALKER), count=25, **keys) as world:
        arena = polygon_of(tuple((x, y) for x, y in CORNERS))
        obstacles = [area_of(Obstacle(blocks_light=False, **obstacle)) for obstacle in OBSTACLES]
        first = world.poses.copy()
        for _ in range(20):
            world.run(10)
            for x, y, _ in world.poses:
                body = disc(float(x), float(y), 2 * 0.95 * RADIUS_M)
                assert lies_inside(body, arena)
                assert not any(overlap(body, obstacle) for obstacle in obstacles)
        moved = np.hypot(*(world.poses - first)[:, :2].T)
    assert np.median(moved) > 3 * RADIUS_M


@pytest.mark.parametrize("blocks_light", [False, True])
def test_light_stops_at_what_blocks_it(program: Program, *, blocks_light: bool) -> None:
    plate = {
        "shape": "rectangle",
        "centre_m": [0.0, 0.0],
        "width_m": 0.005,
        "height_m": 0.3,
        "blocks_light": blocks_light,
    }
    lamp = {"at_m": [-0.3, 0.0], "peak": 900.0, "half_m": 1.0}
    with World(
        program=program(TALKER),
        poses=[[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0]],
        arena=[1.0, 1.0],
        obstacle=[plate],
        light={"ambient": 100.0, "source": [lamp]},
    ) as world:
        world.run(5)
        heard, lit, dark = RGB(0, 3, 0), RGB(3, 0, 0), RGB(0, 0, 0)
        expected = [lit, dark] if blocks_light else [heard, heard]
        assert world.leds.tolist() == expected


def test_an_arena_without_room_says_so(program: Program) -> None:
    wedge = [[-0.5, -0.015], [0.5, -0.015], [0.5, 0.015], [-0.5, 0.015]]
    with pytest.raises(InputError, match="robot 1 finds no free place in the arena"):
        World(program=program(WALKER), count=1, arena=wedge)


@pytest.mark.long
def test_nothing_passes_a_wall_in_a_hundred_million_robot_steps() -> None:
    """The random walks of tests/native/emulator/test_walls.cpp, for longer."""
    run_thoroughly("nothing passes a wall*", 1)


@pytest.mark.long
def test_crowds_overlap_by_little_at_any_step() -> None:
    run_thoroughly("a hundred robots*", 4)


@pytest.mark.long
def test_a_busy_channel_loses_as_many_frames_as_by_brute_force() -> None:
    run_thoroughly("*by brute force", 3)


def run_thoroughly(cases: str, count: int) -> None:
    """Native cases that try a part of what they can in `make test`, whole."""
    binary = ROOT / "build/engine/tests/native/emulator/emulator_tests"
    done = subprocess.run(
        [binary, f"--test-case={cases}", "--no-version=true"],
        env={**os.environ, "KILOTWIN_TEST_LONG": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert f"{count} passed" in done.stdout
