"""Floors and light from pictures, with real programs."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from kilotwin import RGB, World

SITES = """\
#include <kilolib.h>
static volatile uint8_t site;
static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    if (message->type == 1) site = message->data[0];
}
static void setup(void) {}
static void loop(void) {
    spinup_motors();
    set_motors(kilo_straight_left, kilo_straight_right);
    set_color(site == 1 ? RGB(1, 0, 0) : site == 2 ? RGB(0, 1, 0) : RGB(0, 0, 0));
}
int main(void) {
    kilo_message_rx = on_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
"""
LIGHT = """\
#include <kilolib.h>
static void setup(void) {}
static void loop(void) { set_color(get_ambientlight() > 400 ? RGB(3, 3, 0) : RGB(0, 0, 0)); }
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""


def test_the_virtual_floor_tells_which_colour_a_robot_is_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sites.c").write_text(SITES)
    # Stripes of 0.2 m along x: nest, nothing, food, nothing ...
    stripes = np.full((2, 20, 3), 255, dtype=np.uint8)
    stripes[:, 0::4] = (0, 0, 0)
    stripes[:, 2::4] = (255, 0, 0)
    Image.fromarray(stripes).save(tmp_path / "stripes.png")
    legend = {"#000000": "nest", "#ff0000": "food", "#ffffff": ""}
    shown = {0: RGB(1, 0, 0), 1: RGB(0, 0, 0), 2: RGB(0, 1, 0), 3: RGB(0, 0, 0)}
    with World(
        profile="foot-bot",
        program="sites.c",
        poses=[[-1.9, 0.0, 0.0]],
        arena=[6.0, 1.0],
        floor={"image": "stripes.png", "width_m": 4.0, "legend": legend},
    ) as world:
        seen = set()
        for _ in range(36):
            world.run(1)
            along = (float(world.poses[0, 0]) + 2) / 0.2
            if 0.1 < along % 1 < 0.9 and along < 20:
                assert world.leds[0] == shown[int(along) % 4]
                seen.add(int(along))
        assert len(seen) > 12


def test_robots_read_the_light_of_a_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "light.c").write_text(LIGHT)
    image = Image.new("L", (2, 1), 0)
    image.putpixel((1, 0), 255)
    image.save(tmp_path / "half.png")
    with World(
        program="light.c",
        poses=[[-0.2, 0.0, 0.0], [0.2, 0.0, 0.0], [0.45, 0.3, 0.0]],
        arena=[1.0, 1.0],
        light={"ambient": 100.0, "picture": {"image": "half.png", "width_m": 0.8, "white": 500.0}},
    ) as world:
        world.run(2)
        assert world.leds.tolist() == [RGB(0, 0, 0), RGB(3, 3, 0), RGB(0, 0, 0)]
