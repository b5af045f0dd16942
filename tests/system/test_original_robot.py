"""Robots with the published runtime's traits begin and measure as its specification has it
(hardware.md 1.3, 1.8), on every processor alike."""

from collections.abc import Callable
from pathlib import Path

import pytest

from kilotwin.runs.reader import Run
from kilotwin.units import TICK_S

from .conftest import Kilotwin

BEGINS = """\
#define DEBUG
#include <debug.h>
#include <kilolib.h>
static void setup(void) { printf("begun\\n"); }
static void loop(void) {}
int main(void) { kilo_init(); debug_init(); kilo_start(setup, loop); return 0; }
"""

# The first robot talks; the others read the battery between the second and the third message.
MEASURES = """\
#define DEBUG
#include <debug.h>
#include <kilolib.h>
static message_t word;
static volatile uint8_t heard;
static volatile int16_t gains[4];
static int16_t voltage = -1;
static uint8_t told;
static message_t *talk(void) { return kilo_uid == 1 ? &word : NULL; }
static void hear(message_t *message, distance_measurement_t *distance) {
    if (message->type == NORMAL && heard < 4) gains[heard++] = distance->high_gain;
}
static void setup(void) {
    word.type = NORMAL;
    word.crc = message_crc(&word);
}
static void loop(void) {
    if (heard == 2 && voltage < 0) voltage = get_voltage();
    if (heard < 4 || told) return;
    told = 1;
    printf("%d %d %d %d\\n", voltage, gains[1], gains[2], gains[3]);
}
int main(void) {
    kilo_init();
    debug_init();
    kilo_message_rx = hear;
    kilo_message_tx = talk;
    kilo_start(setup, loop);
    return 0;
}
"""

EXPERIMENT = """
name = "original"
seed = 3
duration_s = 6

[arena]
shape = "rectangle"
width_m = 1
height_m = 1

[swarm]
profile = "kilobot"

[medium]
loss = 0
loss_at_range = 0

[[robots]]
program = "robot.c"
count = 4
poses = [[0, 0, 0], [0.06, 0, 0], [-0.06, 0, 0], [0, 0.06, 0]]

[[command]]
at_s = 0.5
send = "run"

[states]
green = "green"
"""
RUN_S = 0.5
CPUS = ("native", "translated", "avr")

Prints = Callable[..., dict[int, tuple[float, str]]]


@pytest.fixture
def prints(tmp_path: Path, kilotwin: Kilotwin) -> Prints:
    """Prints of each robot, with their times."""

    def run(program: str, cpu: str, runtime: str = "") -> dict[int, tuple[float, str]]:
        (tmp_path / "robot.c").write_text(program)
        (tmp_path / "original.toml").write_text(EXPERIMENT)
        out = tmp_path / f"{cpu}-{runtime}"
        more = ["--set", f"robots.0.runtime={runtime}"] if runtime else []
        words = ["--out", out, "--quiet", "--set", f"robots.0.cpu={cpu}", *more]
        kilotwin("run", tmp_path / "original.toml", *words)
        events = [event for event in Run.open(out).events() if event["kind"] == "print"]
        return {event["robot"]: (event["time_s"] - RUN_S, event["text"]) for event in events}

    return run


def test_a_robot_begins_when_its_blink_is_over(prints: Prints) -> None:
    """Each at its own moment, for they were switched on at different ones; told to the tick."""
    delays = {cpu: {robot: at for robot, (at, _) in prints(BEGINS, cpu).items()} for cpu in CPUS}
    for cpu in CPUS:
        assert sorted(delays[cpu]) == [0, 1, 2, 3], delays
        assert max(delays[cpu].values()) < 0.201 + TICK_S
        assert max(delays[cpu].values()) - min(delays[cpu].values()) > TICK_S
        for robot, delay in delays[cpu].items():
            assert delay == pytest.approx(delays["avr"][robot], abs=1.05 * TICK_S), delays


@pytest.mark.parametrize("cpu", CPUS)
def test_ours_begins_soon(prints: Prints, cpu: str) -> None:
    delays = [at for at, _ in prints(BEGINS, cpu, "kilotwin").values()]
    assert len(delays) == 4
    assert max(delays) < TICK_S


@pytest.mark.parametrize("cpu", CPUS)
def test_after_the_battery_was_read_the_next_distance_is_wrong(prints: Prints, cpu: str) -> None:
    """Its high gain is the battery's reading, and those before and after are not."""
    said = prints(MEASURES, cpu)
    assert len(said) == 3
    for _, text in said.values():
        voltage, before, wrong, after = map(int, text.split())
        assert wrong == pytest.approx(voltage, abs=4), text
        assert before == pytest.approx(after, abs=12), text
        assert abs(before - voltage) > 20, text


@pytest.mark.parametrize("cpu", CPUS)
def test_ours_puts_the_converter_back(prints: Prints, cpu: str) -> None:
    for _, text in prints(MEASURES, cpu, "kilotwin").values():
        _, before, between, after = map(int, text.split())
        assert before == pytest.approx(between, abs=12), text
        assert before == pytest.approx(after, abs=12), text
