"""Messages that come beside the medium, as those of [[command]], are missed by no robot that runs
translated, also if several come at once: the light of frames has nothing to do with them."""

from pathlib import Path

import pytest

from kilotwin import _emulator
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.engine import engine_spec
from kilotwin.programs.group import build_group

PROGRAM = """\
#define DEBUG
#include <debug.h>
#include <kilolib.h>
static volatile uint8_t heard;
static uint8_t told;
static void hear(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    if (message->type == 5) heard++;
}
static void setup(void) {}
static void loop(void) {
    if (heard == told) return;
    delay(100);
    told = heard;
    printf("%u\\n", told);
}
int main(void) {
    kilo_init();
    debug_init();
    kilo_message_rx = hear;
    kilo_start(setup, loop);
    return 0;
}
"""
EXPERIMENT = """
name = "told"
seed = 1
duration_s = 4
[arena]
shape = "circle"
diameter_m = 1
[swarm]
profile = "{profile}"
floor = false
[[robots]]
program = "{program}"
cpu = "translated"
count = 3
[[command]]
at_s = 0
send = "run"
"""
COMMAND = """
[[command]]
at_s = 2
send = "user"
type = 5
data = [{number}]
"""


@pytest.mark.parametrize("profile", ["kilobot", "foot-bot"])
def test_four_commands_at_once_are_all_heard(profile: str, tmp_path: Path) -> None:
    program = tmp_path / "hears.c"
    program.write_text(PROGRAM)
    file = tmp_path / "told.toml"
    commands = "".join(COMMAND.format(number=number) for number in range(4))
    file.write_text(EXPERIMENT.format(profile=profile, program=program) + commands)
    experiment = Experiment.load(file)
    guests = [str(build_group(group).file) for group in experiment.groups]
    simulation = _emulator.Simulation(
        engine_spec(experiment, guests, sample_ticks=31, black_box=None)
    )
    simulation.advance(31 * 4)
    printed = [(event["robot"], event["text"].strip()) for event in simulation.events()]
    assert sorted(printed) == [(robot, "4") for robot in range(3)]
