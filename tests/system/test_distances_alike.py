"""estimate_distance() gives the same for every pair of readings, natively, translated and on the
chip: whole numbers, by the same C (kilolib/core/gains.h)."""

from pathlib import Path

from kilotwin.runs.reader import Run

from .conftest import Kilotwin

# A checksum of the estimates for each low reading, over high ones.
PROGRAM = """\
#include <kilolib.h>
#define DEBUG
#include <debug.h>
static uint16_t row(int16_t low) {
    uint16_t sum = 0;
    for (int16_t high = 0; high < 1024; high += 5) {
        const distance_measurement_t measured = {.low_gain = low, .high_gain = high};
        sum = (uint16_t)(sum * 31u + estimate_distance(&measured));
    }
    return sum;
}
static void setup(void) {}
static void loop(void) {
    static int16_t low;
    if (low >= 1024) return;
    printf("%d %u\\n", low, row(low));
    low += 7;
}
int main(void) {
    kilo_init();
    debug_init();
    kilo_start(setup, loop);
    return 0;
}
"""
CPUS = ("native", "translated", "avr")
EXPERIMENT = """
name = "distances"
duration_s = 12
[arena]
shape = "rectangle"
width_m = 2
height_m = 1
[swarm]
profile = "kilobot"
[medium]
sensitivity_spread = 0
[states]
green = "green"
"""
ROBOTS = "".join(
    f'[[robots]]\nprogram = "distances.c"\ncpu = "{cpu}"\ncount = 1\nposes = [[{x}, 0, 0]]\n'
    for cpu, x in zip(CPUS, (-0.5, 0, 0.5), strict=True)
)


def test_every_pair_of_readings_gives_the_same_on_all_processors(
    tmp_path: Path, kilotwin: Kilotwin
) -> None:
    (tmp_path / "distances.c").write_text(PROGRAM)
    (tmp_path / "distances.toml").write_text(EXPERIMENT + ROBOTS)
    kilotwin("run", tmp_path / "distances.toml", "--out", tmp_path / "run", "--quiet", "--no-twin")
    said: dict[int, list[str]] = {0: [], 1: [], 2: []}
    for event in Run.open(tmp_path / "run").events():
        if event["kind"] == "print":
            said[event["robot"]].append(event["text"])
    assert len(said[0]) == len(range(0, 1024, 7))
    assert len({line.split()[1] for line in said[0]}) > 50
    assert said[1] == said[0]
    assert said[2] == said[0]
