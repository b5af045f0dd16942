"""A robot that runs translated loses the frames whose edges its chip loses: those that come while
interrupts are held back, by a conversion, by cli() or by a callback.

One robot talks, others listen, as translated ones and as chips. Where in a frame interrupts are
held is chance: the same share of frames is taken, not the same frames.
"""

import math
from pathlib import Path

import pytest

from kilotwin import World

TALKER = """\
#include <kilolib.h>
static message_t out = {{37, 48, 85, 122, 159, 196, 233, 14, 51}, NORMAL, 0};
static message_t *tell(void) { return &out; }
static void setup(void) { out.crc = message_crc(&out); }
static void loop(void) {}
int main(void) {
    kilo_init();
    kilo_message_tx = tell;
    kilo_start(setup, loop);
    return 0;
}
"""
# How many it has heard is its colour.
LISTENER = """\
#include <avr/interrupt.h>
#include <kilolib.h>
#include <util/delay.h>
static uint8_t heard;
volatile uint16_t sink;
static void hear(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    set_color(++heard & 63);
}
static message_t *ask(void) { %s; return 0; }
static void setup(void) { kilo_tx_period = 0; }
static void loop(void) { %s; }
int main(void) {
    kilo_init();
    kilo_message_rx = hear;
    kilo_message_tx = ask;
    kilo_start(setup, loop);
    return 0;
}
"""
# Code of the callback that each tick asks for a message, and code of loop().
PROGRAMS = {
    "nothing": ("", ""),
    "rand_hard": ("", "sink = rand_hard()"),
    "rand_hard_now_and_then": ("", "sink = rand_hard(); delay(1)"),
    "temperature": ("", "sink = get_temperature(); _delay_loop_1(rand_soft() | 1)"),
    "voltage": ("", "sink = get_voltage(); _delay_loop_1(rand_soft() | 1)"),
    "light": ("", "sink = get_ambientlight(); _delay_loop_1(rand_soft() | 1)"),
    "held_for_moments": ("", "cli(); sink = kilo_ticks; sei()"),
    "held_for_a_slot": ("", "_delay_loop_2(10000); cli(); _delay_loop_2(130); sei()"),
    "held_for_a_frame": ("", "cli(); _delay_loop_2(5000); sei(); _delay_loop_2(50000)"),
    "long_callback": ("_delay_loop_2(5000)", ""),
}
LISTENERS, FOR_S = 6, 27.0
MOST_APART = 0.12


def taken(folder: Path, name: str, runtime: str, cpu: str) -> float:
    """The share of its frames that listeners take."""
    talker, listener = folder / "talker.c", folder / f"{name}.c"
    talker.write_text(TALKER)
    listener.write_text(LISTENER % PROGRAMS[name])
    turns = [2 * math.pi * i / LISTENERS for i in range(LISTENERS)]
    around = [[0.05 * math.cos(turn), 0.05 * math.sin(turn), 0] for turn in turns]
    robots = [
        {"program": str(talker), "count": 1, "poses": [[0, 0, 0]], "cpu": "native"},
        {"program": str(listener), "count": LISTENERS, "poses": around, "cpu": cpu},
    ]
    robots[1]["runtime"] = runtime
    medium = {"kind": "kilobot", "loss": 0, "loss_at_range": 0}
    with World(robots=robots, seed=1, medium=medium) as world:
        world.run(FOR_S)
        heard, sent = sum(int(color) for color in world.leds[1:]), int(world.frames[0, 0])
        assert cpu == "avr" or world.stats["frames_delivered"] == heard
        return heard / (sent * LISTENERS)


@pytest.mark.parametrize("runtime", ["kilotwin", "original"])
@pytest.mark.parametrize("name", PROGRAMS)
def test_as_many_frames_are_lost_as_on_the_chip(name: str, runtime: str, tmp_path: Path) -> None:
    translated, chip = (taken(tmp_path, name, runtime, cpu) for cpu in ("translated", "avr"))
    assert abs(translated - chip) < MOST_APART
    if name in ("nothing", "held_for_moments"):
        assert min(translated, chip) > 0.98
    elif name in ("rand_hard", "held_for_a_slot", "held_for_a_frame"):
        assert max(translated, chip) < 0.9
