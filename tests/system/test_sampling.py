"""How often programs change LED and motors is counted alike, however they are executed."""

from pathlib import Path

import pytest

from .conftest import Program, RunJson

# Each 16 ticks, 0.524 s, another colour, and motors on with a kick: that is one change.
BLINKER = """\
#include <kilolib.h>
static uint32_t next;
static uint8_t on;
static void setup(void) {}
static void loop(void) {
    if (kilo_ticks < next) return;
    next = kilo_ticks + 16;
    on = !on;
    set_color(on ? RGB(1, 2, 3) : RGB(0, 0, 0));
    spinup_motors();
    set_motors(on ? kilo_straight_left : 0, kilo_straight_right);
}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
WORLD = """\
duration_s = 40
[arena]
diameter_m = 1.0
[swarm]
profile = "kilobot"
program = "program.c"
size = 3
"""


@pytest.mark.parametrize("cpu", ["translated", "native", "avr"])
def test_changes_of_led_and_motors_are_counted(
    run_json: RunJson, program: Program, tmp_path: Path, cpu: str
) -> None:
    program(BLINKER)
    (tmp_path / "world.toml").write_text(WORLD)
    counts = []
    for duration_s in (10, 40):  # on the chip the runtime blinks at the start
        settings = f"swarm.cpu={cpu}", f"duration_s={duration_s}"
        summary = run_json(tmp_path / "world.toml", *settings)
        counts.append(summary["simulated_s"] / summary["decision_s"])
    assert 30 / (counts[1] - counts[0]) == pytest.approx(0.524, rel=0.02)
