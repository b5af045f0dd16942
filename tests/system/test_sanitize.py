"""`--sanitize`: what the C standard leaves undefined is named with file and line, once a place."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from .conftest import Kilotwin

# Robot N does what the line ends in: "// N: what is told".
PROGRAM = """\
#include <kilolib.h>
#include <limits.h>
static uint8_t table[10], what = 99, kept;
static volatile int one = 1, many = 40, most = INT_MAX, minus = -1, zero;
static volatile uint8_t twelve = 12;
static uint8_t *volatile nowhere;
static volatile float far = 300000.0f;
static void rx(message_t *message, distance_measurement_t *d) { what = message->data[0]; }
static void setup(void) {}
static void loop(void) {
    switch (what) {
    case 0: kept += table[twelve]; break;  // 0: index 12 out of bounds for type uint8_t [10]
    case 1: kept += one << many; break;  // 1: a shift by 40 bits of int, which has 32
    case 2: kept += one << minus; break;  // 2: a shift by -1, which is negative
    case 3: kept += most + one; break;  // 3: 2147483647 + 1 does not fit into int
    case 4: kept += one / zero; break;  // 4: a division by zero
    case 5: kept += *nowhere; break;  // 5: a load of uint8_t by a pointer that is NULL
    case 6: kept += (uint8_t)far; break;  // 6: a number of type float that is out of the range of
    case 7: table[kept & 7]++; break;
    }
}
int main(void) { kilo_init(); kilo_message_rx = rx; kilo_start(setup, loop); return 0; }
"""
EXPERIMENT = """\
duration_s = {duration_s}
arena.diameter_m = 1
swarm.profile = "kilobot"
swarm.size = {size}
swarm.program = "undefined.c"
"""
BAD = 7


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("sanitize")
    (made / "undefined.c").write_text(PROGRAM)
    text = EXPERIMENT.format(duration_s=2, size=8)
    command = '[[command]]\nat_s = 0.1\nsend = "run"\n'
    for robot in range(8):
        act = f'[[command]]\nat_s = 1\nsend = "user"\ntype = 1\ndata = [{robot}]\n'
        act += f"robot = {robot + 1}\n"
        command += act
    (made / "undefined.toml").write_text(text + command)
    return made


def events_of(run: Path) -> list[dict[str, Any]]:
    rows = map(json.loads, (run / "events.jsonl").read_text().splitlines())
    return [row for row in rows if row["kind"] == "undefined_behaviour"]


def test_each_is_told_once_with_its_line_and_fails_the_run(
    kilotwin: Kilotwin, folder: Path
) -> None:
    run = folder / "run"
    words = (folder / "undefined.toml", "--sanitize", "--out", run, "--json")
    done = kilotwin("run", *words, expect=4)
    told = {event["robot"]: event for event in events_of(run)}
    assert len(events_of(run)) == BAD  # none of the last robot
    for line, row in enumerate(PROGRAM.splitlines(), 1):
        if match := re.search(r"// (\d): (.*)", row):
            event = told[int(match[1])]
            assert (event["line"], event["function"]) == (line, "loop")
            assert f"at undefined.c:{line} in loop(): {match[2]}" in event["text"]
    summary = json.loads(done.stdout)
    assert len(summary["undefined"]) == BAD
    assert summary["robots_failed"] == []
    assert "undefined behaviour at undefined.c:12 in loop(): index 12 out of bounds" in done.stderr


def test_a_program_that_does_none_of_it_has_the_same_result(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    words = ("experiments/paper/simplified-n100.toml", "--set", "duration_s=60", "--json")
    native = ("--set", "swarm.cpu=native", "--no-twin")
    plain, looked = (
        json.loads(kilotwin("run", *words, *more, "--out", tmp_path / more[0][2:5]).stdout)
        for more in (native, ("--sanitize",))
    )
    assert looked["undefined"] == []
    assert looked["result_hash"] == plain["result_hash"]


def test_a_scenario_fails_at_the_line_unless_it_is_expected(
    kilotwin: Kilotwin, folder: Path
) -> None:
    scenario, expected = folder / "scenario.toml", '[[expect]]\nthat = "failed == 0"\n'
    text = (folder / "undefined.toml").read_text()
    scenario.write_text(text + expected)
    words = ("test", scenario, "--no-keep", "--junit", folder / "j.xml")
    kilotwin(*words)
    done = kilotwin(*words, "--sanitize", expect=1)
    assert "no_undefined = true: robot 1 (undefined) at 1." in done.stdout
    assert 'file="' + str(folder / "undefined.c") in (folder / "j.xml").read_text()
    scenario.write_text(text + expected + "[[expect]]\nno_undefined = false\n")
    kilotwin(*words, "--sanitize")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--coverage",), "--sanitize runs programs natively, and --coverage by their machine"),
        (("--set", "swarm.cpu=avr"), 'set it to "native"'),
    ],
)
def test_programs_that_run_by_their_machine_code_are_refused(
    kilotwin: Kilotwin, folder: Path, options: tuple[str, ...], said: str
) -> None:
    done = kilotwin("run", folder / "undefined.toml", "--sanitize", *options, expect=2)
    assert said in done.stderr
