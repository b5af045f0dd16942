"""A robot's printf() prints a float as the library that its image is linked with does."""

from pathlib import Path

import pytest

from kilotwin import World

PROGRAM = """\
#define DEBUG
#include <debug.h>
#include <kilolib.h>
#include <stdio.h>
static uint8_t done;
static void setup(void) {}
static void loop(void) {
    if (!done) printf("%.2f of %d\\n", kilo_ticks * 0.0f + 1.25f, 5);
    done = 1;
}
int main(void) { kilo_init(); debug_init(); kilo_start(setup, loop); return 0; }
"""
WHOLE, WITHOUT = "1.25 of 5\n", "? of 5\n"


@pytest.mark.parametrize(
    ("cpu", "printf", "printed"),
    [
        ("translated", "integers", WITHOUT),
        ("translated", "floats", WHOLE),
        ("avr", "integers", WITHOUT),
        ("avr", "floats", WHOLE),
        ("native", "integers", WHOLE),
        ("native", "floats", WHOLE),
    ],
)
def test_floats_are_printed_as_linked_and_by_native_programs_always(
    cpu: str, printf: str, printed: str, tmp_path: Path
) -> None:
    (tmp_path / "my.c").write_text(PROGRAM)
    (tmp_path / "my.toml").write_text(f"""\
name = "prints"
duration_s = 10
[arena]
diameter_m = 1
[swarm]
profile = "kilobot"
[[robots]]
program = "my.c"
count = 1
cpu = "{cpu}"
printf = "{printf}"
[medium]
kind = "kilobot"
""")
    with World(tmp_path / "my.toml", seed=1) as world:
        world.run(1)
        assert world.prints(0) == printed
