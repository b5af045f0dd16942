"""Faults of a program are told with file and line, native and by its machine code."""

import json
import re
from pathlib import Path

import pytest

from kilotwin import World

from .conftest import Kilotwin

# Robot N has the fault of which the line ends in "// N".
PROGRAM = """\
#include <assert.h>
#include <kilolib.h>
#include <stdlib.h>
#include <string.h>
#include "faults.h"

static uint8_t fault = 99, table[10];
static uint8_t *volatile wild = (uint8_t *)0x123456789000;
static void (*volatile nowhere)(void);
static volatile int zero;
static void *(*volatile copy)(void *, const void *, size_t) = memcpy;

static inline uint8_t look(volatile uint8_t *at) {
    return at[3];  // 0
}

__attribute__((noinline)) static int deep(int n) {
    volatile char room[4000];
    room[n % 4000] = n;  // 1
    return deep(n + 1) + room[5];
}

__attribute__((noinline)) static void give_up(void) {
    table[8]++;
    abort();  // 2
}

static void rx(message_t *message, distance_measurement_t *d) { fault = message->data[0]; }
static void setup(void) {}
static void loop(void) {
    volatile uint32_t n = 1;
    switch (fault) {
    case 0: table[0] = look(wild); break;
    case 1: table[1] = deep(kilo_ticks); break;
    case 2: give_up(); break;
    case 3:
        while (n) n += 2;  // 3
        break;
    case 4:
        table[2] = 100 / zero;  // 4
        break;
    case 5:
        nowhere();  // 5
        table[3]++;
        break;
    case 6:
        copy(wild, "hello", 100 + zero);  // 6
        table[4]++;
        break;
    case 7:
        for (;;);  // 7
    case 8:
        assert(zero == 3);  // 8
        break;
    case 9: in_a_header(wild); break;
    }
}
int main(void) {
    kilo_init();
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
"""
HEADER = """\
static inline void in_a_header(uint8_t *at) {
    *at = 1;  // 9
}
"""
ON_THE_CHIP = """\
#include <kilolib.h>
static void (*volatile away)(void) = (void (*)(void))0x3000;
static uint8_t *volatile nowhere = (uint8_t *)0x0F00;
static volatile uint8_t counter;
__attribute__((noinline)) static void leave(void) {
    if (WRITES) *nowhere = 3;  // writes
    if (!WRITES) away();  // leaves
    counter++;
}
static void setup(void) {}
static void loop(void) { leave(); counter++; }
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
FUNCTIONS = {0: "look", 1: "deep", 2: "give_up", 9: "in_a_header"}


def lines_of(text: str) -> dict[int, int]:
    """Line by the number at its end."""
    numbered = enumerate(text.splitlines(), 1)
    found = ((re.search(r"// (\d)$", row), line) for line, row in numbered)
    return {int(match[1]): line for match, line in found if match}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("crash_lines")
    (made / "faulty.c").write_text(PROGRAM)
    (made / "faults.h").write_text(HEADER)
    (made / "chip.c").write_text(ON_THE_CHIP)
    return made


@pytest.fixture(scope="module")
def told(folder: Path) -> dict[int, dict[str, object]]:
    """The first event of each robot."""
    with World(program=str(folder / "faulty.c"), count=10, cpu="native") as world:
        for robot in range(10):
            world.send([robot], robot=robot)
        world.run(12)
        return {event["robot"]: event for event in reversed(world.events)}


@pytest.mark.parametrize("robot", range(10))
def test_a_fault_is_told_with_its_line(
    told: dict[int, dict[str, object]], folder: Path, robot: int
) -> None:
    file, text = ("faults.h", HEADER) if robot == 9 else ("faulty.c", PROGRAM)
    event, line = told[robot], lines_of(text)[robot]
    function = FUNCTIONS.get(robot, "loop")
    assert (event["file"], event["line"]) == (str(folder / file), line)
    assert event["function"] == function
    assert str(event["text"]).startswith(f"at {file}:{line} in {function}(): ")


@pytest.mark.parametrize(("cpu", "writes"), [("translated", 0), ("avr", 1)])
def test_so_is_one_of_its_machine_code(folder: Path, cpu: str, writes: int) -> None:
    keys = {"program": str(folder / "chip.c"), "cpu": cpu, "define": [f"WRITES={writes}"]}
    kind = "crash" if writes else "note"
    with World(robots=[{**keys, "count": 2}]) as world:
        world.run(3)
        events = [event for event in world.events if event["kind"] == kind]
    line = 6 if writes else 7
    assert [event["robot"] for event in events] in ([0, 1], [1, 0])
    assert {(event["line"], event["function"]) for event in events} == {(line, "leave")}


def test_a_confined_run_tells_it_once_per_cause(kilotwin: Kilotwin, folder: Path) -> None:
    experiment = folder / "faulty.toml"
    experiment.write_text(
        'duration_s = 3\narena.diameter_m = 1\n[swarm]\nprofile = "kilobot"\nsize = 6\n'
        'cpu = "native"\nprogram = "faulty.c"\n'
        '[[command]]\nat_s = 0.1\nsend = "run"\n'
        '[[command]]\nat_s = 1\nsend = "user"\ntype = 1\ndata = [0]\n'
    )
    run = folder / "run"
    done = kilotwin("run", experiment, "--out", run, "--no-twin", "--json", expect=4)
    line = lines_of(PROGRAM)[0]
    text = f"crash at faulty.c:{line} in look(): Segmentation fault at address 0x123456789003"
    assert f"6 robots failed:\n{text}: robots " in done.stderr
    (cause,) = json.loads(done.stdout)["causes"]
    assert (cause["line"], cause["robots"]) == (line, 6)
    events = [json.loads(row) for row in (run / "events.jsonl").read_text().splitlines()]
    assert {(event["robot"], event["line"]) for event in events} == {(n, line) for n in range(6)}
