"""A robot that hangs is told with its line, by its machine code as natively; others go on."""

from pathlib import Path
from typing import Any

import pytest

from kilotwin import World

from .outcomes import outcome as engine_outcome

# By its uid a robot hangs in one of three ways, or waits for long in delay(), or in loop() for
# something that comes.
PROGRAM = """\
#include <avr/interrupt.h>
#include <kilolib.h>

static volatile uint8_t never;
static message_t message;

static message_t *message_tx(void) { return &message; }
static void message_rx(message_t *m, distance_measurement_t *d) {
    if (kilo_uid % 5 != 2) return;
    for (;;) never++;  // in the callback
}
static void setup(void) {
    message.type = NORMAL;
    message.crc = message_crc(&message);
    while (kilo_uid % 5 == 1);  // in setup()
}
static void loop(void) {
    if (kilo_uid % 5 == 0)
        while (!never);  // in loop()
    if (kilo_uid % 5 == 3) delay(30000);
    const uint32_t until = kilo_ticks + 200;
    while (kilo_ticks < until);
}
int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_message_tx = message_tx;
    kilo_start(setup, loop);
    return 0;
}
"""
WORLD = """
name = "hangs"
seed = 4
duration_s = 60

[arena]
shape = "circle"
diameter_m = 0.16

[swarm]
profile = "kilobot"
floor = false

[medium]
kind = "{medium}"

[[robots]]
program = "hangs.c"
cpu = "{cpu}"
count = 5
"""
TICKS = 700


def file_with(folder: Path, cpu: str, medium: str = "kilobot") -> Path:
    (folder / "hangs.c").write_text(PROGRAM)
    file = folder / "hangs.toml"
    file.write_text(WORLD.format(cpu=cpu, medium=medium))
    return file


def lines_named(text: str) -> set[int]:
    return {n for n, line in enumerate(PROGRAM.splitlines(), 1) if f"// in {text}" in line}


def test_each_robot_that_hangs_is_named_once_with_its_line(tmp_path: Path) -> None:
    with World(str(file_with(tmp_path, "translated"))) as world:
        world.run(20)
        told = [event for event in world.events if event["kind"] == "busy_wait"]
    assert len(told) == 3
    assert {event["line"] for event in told} == (
        lines_named("loop()") | lines_named("setup()") | lines_named("the callback")
    )


@pytest.mark.parametrize("medium", ["ideal", "kilobot"])
def test_it_is_told_at_the_same_cycle_however_far_robots_run_at_once(
    medium: str, tmp_path: Path
) -> None:
    file = file_with(tmp_path, "translated", medium)

    def outcome(chunk: int, **spec: Any) -> tuple[Any, ...]:
        return engine_outcome(file, ticks=TICKS, chunk=chunk, sample_ticks=31, **spec)

    first = outcome(TICKS)
    assert len(first[1]) == 3
    assert outcome(20) == first
    assert outcome(TICKS, run_ahead=False) == first
    assert outcome(TICKS, recalls_passes=False) == first
