"""A robot has one number wherever it is read or typed: its uid."""

import json
from pathlib import Path

import pyarrow as pa
import pytest

from .conftest import Kilotwin

PROGRAM = """\
#define DEBUG
#include <debug.h>
#include <kilolib.h>
static void on_message(message_t *m, distance_measurement_t *d) {
    (void)d;
    if (m->type == 5) set_color(RGB(3, 0, 0));
}
static void setup(void) { debug_init(); printf("I am %u\\n", kilo_uid); }
static void loop(void) {
    if (kilo_uid == NUMBER && kilo_ticks > 100) *(volatile uint8_t *volatile)FAR = 1;
}
int main(void) {
    kilo_init();
    kilo_message_rx = on_message;
    kilo_start(setup, loop);
    return 0;
}
"""
EXPERIMENT = """\
duration_s = 8
[arena]
diameter_m = 0.6
[swarm]
profile = "kilobot"
cpu = "native"
program = "program.c"
size = 4
LAB
[[command]]
at_s = 0
send = "run"
[[command]]
at_s = 1
send = "user"
type = 5
robot = NUMBER
[[step]]
at_s = 1
robot = NUMBER
pose = [0.05, 0.1, 0.0]
"""
LAB = """\
[robot.3]
[robot.17]
[robot.40]
[robot.41]
"""


@pytest.mark.parametrize(("number", "index", "lab"), [(3, 2, False), (40, 2, True)])
def test_a_robot_is_the_same_on_the_terminal_in_prints_and_in_what_is_typed(
    kilotwin: Kilotwin, tmp_path: Path, number: int, index: int, lab: bool
) -> None:
    text = PROGRAM.replace("NUMBER", str(number)).replace("FAR", "0x123456789000")
    (tmp_path / "program.c").write_text(text)
    (tmp_path / "lab.toml").write_text(LAB)
    text = EXPERIMENT.replace("NUMBER", str(number))
    text = text.replace("LAB", 'lab = "lab.toml"' if lab else "")
    (tmp_path / "my.toml").write_text(text)
    run = tmp_path / "run"
    done = kilotwin("run", tmp_path / "my.toml", "--out", run, "--no-twin", expect=4)
    assert f": robot {number} (program), from tick " in done.stderr
    assert f"I am {number}\n" in (run / f"prints/robot-{number}.log").read_text()
    events = [json.loads(line) for line in (run / "events.jsonl").read_text().splitlines()]
    (crash,) = [event for event in events if event["kind"] == "crash"]
    assert (crash["robot"], crash["uid"]) == (index, number)
    table = pa.ipc.open_stream(run / "robots.arrows").read_all().to_pandas()
    last = table[table.tick == table.tick.max()].set_index("robot")
    assert [row.led for _, row in last.iterrows()].index(3) == index
    assert (round(last.x_m[index], 3), round(last.y_m[index], 3)) == (0.05, 0.1)


def test_a_number_that_no_robot_has_is_refused_with_those_that_there_are(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    (tmp_path / "program.c").write_text(PROGRAM.replace("NUMBER", "1").replace("FAR", "1"))
    (tmp_path / "lab.toml").write_text(LAB)
    for lab, there in (("", "1 to 4"), ('lab = "lab.toml"', "3, 17, 40 and 41")):
        text = EXPERIMENT.replace("NUMBER", "5").replace("LAB", lab)
        (tmp_path / "my.toml").write_text(text)
        done = kilotwin("run", tmp_path / "my.toml", "--dry-run", expect=2)
        assert f"there is no robot 5; the robots are {there}" in done.stderr
