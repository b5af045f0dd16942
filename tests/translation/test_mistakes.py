"""Mistakes of a program by its machine code are told with their line, once a cause, as natively."""

import re
from pathlib import Path
from typing import Any

import pytest

from kilotwin import World

# Robot N makes the mistake of which the line ends in "// N".
PROGRAM = """\
#include <kilolib.h>

static uint8_t fault = 99, table[10];
static uint8_t *volatile wild = (uint8_t *)0x0F00;
static uint8_t *volatile null;
static void (*volatile nowhere)(void);
static void (*volatile away)(void) = (void (*)(void))0x3000;
static volatile uint8_t zero, deepest, big[900];
static volatile uint32_t stopped;

__attribute__((noinline)) static int deep(int n) {  // 0
    volatile char room[16];
    room[n % 16] = n;
    return deep(n + 1) + room[5];
}
__attribute__((noinline)) static void fill(void) {  // 1
    volatile uint8_t room[1100];
    for (uint16_t i = 0; i < sizeof room; i++) room[i] = 0;
    while (!zero) deepest = room[3];
}

static void rx(message_t *message, distance_measurement_t *d) { fault = message->data[0]; }
static void setup(void) { big[5] = 1; }
static void loop(void) {
    switch (fault) {
    case 0: table[0] = deep(kilo_ticks); break;
    case 1: fill(); break;
    case 2:
        table[2] = 100 / zero;  // 2
        break;
    case 3:
        nowhere();  // 3
        table[3]++;
        break;
    case 4:
        *wild = 4;  // 4
        break;
    case 5:
        *null = 5;  // 5
        break;
    case 6:
        away();  // 6
        table[6]++;
        break;
    case 7:
        for (;;) delay(0);  // 7
    }
}
int main(void) {
    kilo_init();
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
"""
COUNT = 8
SAID = {
    0: ("stack_overflow", "its stack grew over the robot's 2 KB of memory"),
    1: ("note", "its stack has grown down to its variables"),
    2: ("note", "it divides by zero"),
    3: ("note", "it jumped to address 0"),
    4: (
        "note",
        "by a pointer that is NULL or wild, at address 0xf00: there is no memory",
    ),
    5: ("note", "at address 0x000: there are the processor's registers"),
    6: ("note", "it left its program, for flash without code"),
    7: ("busy_wait", "it has been busy for 10 s"),
}


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, Any]]]:
    program = tmp_path_factory.mktemp("mistakes") / "mistaken.c"
    program.write_text(PROGRAM)
    with World(program=str(program), count=COUNT, cpu="translated") as world:
        for robot in range(COUNT):
            world.send([robot], robot=robot)
        world.run(14)
        return program, list(world.events)


@pytest.mark.parametrize("robot", range(COUNT))
def test_a_mistake_is_told_with_its_line_once(
    told: tuple[Path, list[dict[str, Any]]], robot: int
) -> None:
    program, events = told
    kind, text = SAID[robot]
    own = [event for event in events if event["robot"] == robot and text in event["text"]]
    assert [event["kind"] for event in own] == [kind]
    rows = enumerate(PROGRAM.splitlines(), 1)
    (line,) = (number for number, row in rows if re.search(rf"// {robot}$", row))
    assert (own[0]["file"], own[0]["line"]) == (str(program), line)


def test_flash_without_code_leads_to_address_0(tmp_path: Path) -> None:
    """As on the chip: main() begins again."""
    program = tmp_path / "starts_again.c"
    program.write_text(
        "#include <kilolib.h>\n"
        "static void (*volatile away)(void) = (void (*)(void))0x3000;\n"
        "static uint32_t from;\n"
        "static void setup(void) { from = kilo_ticks; }\n"
        "static void loop(void) {\n"
        "    set_color(RGB(1, 0, 0));\n"
        "    if (kilo_ticks > from + 30) away();\n"
        "}\n"
        "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"
    )
    shown = {}
    for cpu in ("translated", "avr"):
        with World(program=str(program), count=1, cpu=cpu) as world:
            world.run(0.5)
            before = int(world.leds[0])
            world.run(3)
            shown[cpu] = (before, int(world.leds[0]))
    assert shown["translated"] == shown["avr"]
    assert shown["avr"][0] != shown["avr"][1]
