"""Modules on chips hear robots of every kind, also while their programs write the lights."""

import can
import pytest

from kilotwin.runs.reader import Run

from .conftest import Kilotwin
from .lab_module import RECEIVES

# As a lab's program: lights and messages of all cells in each pass of loop().
MODULE = (
    RECEIVES
    + """\
static void setup(void) {}
static void loop(void) {
    for (uint8_t cell = 0; cell < N_CELLS; cell++) {
        IR_message_t message;
        init_IR_message(&message);
        message.type = 1;
        message.data[0] = configuration[cell];
        set_LED((cell_num_t)cell, RED);
        set_IR_message(&message, (cell_num_t)cell);
    }
}
int main(void) {
    module_init();
    module_IR_message_rx = receive;
    module_start(setup, loop);
}
"""
)

ROBOT = """\
#include <kilolib.h>
static message_t report;
static message_t *tell(void) { return &report; }
static void setup(void) {
    report.type = 0x10;
    report.data[0] = (uint8_t)kilo_uid;
    report.crc = message_crc(&report);
}
static void loop(void) {}
int main(void) {
    kilo_init();
    kilo_message_tx = tell;
    kilo_start(setup, loop);
    return 0;
}
"""

EXPERIMENT = """
name = "chips on both sides"
duration_s = 30

[grid]
columns = 1
rows = 1
buses = 1
program = "module.c"
configuration = "cells.kconf"
cpu = "avr"

[grid.cells]
weak_share = 0

[swarm]
profile = "kilobot"

[[robots]]
program = "robot.c"
cpu = "avr"
count = 3
poses = [[-0.025, 0.025, 0], [0.025, 0.02, 0], [0.02, -0.03, 0]]

[states]
green = "green"
"""
CELLS = "address\nmodule:0-0\n\ndata\n00\n01\n02\n03\n"
POLL, START = 0x15, 0x14


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory, kilotwin: Kilotwin) -> dict[str, Run]:
    """Robots of all kinds on modules on chips. The host tells them RESET and RUN."""
    folder = tmp_path_factory.mktemp("both")
    files = {"module.c": MODULE, "robot.c": ROBOT, "cells.kconf": CELLS, "both.toml": EXPERIMENT}
    for name, text in files.items():
        (folder / name).write_text(text)

    def run(cpu: str) -> Run:
        words = ["--out", folder / cpu, "--quiet", "--set", f"robots.0.cpu={cpu}"]
        kilotwin("run", folder / "both.toml", *words)
        return Run.open(folder / cpu)

    return {cpu: run(cpu) for cpu in ("native", "translated", "avr")}


def test_robots_of_all_kinds_are_heard_alike(runs: dict[str, Run]) -> None:
    """A quarter of 57 frames each, by the turns of the receiver; of chips it was 1 once."""
    records = {cpu: len(run.tracking()) for cpu, run in runs.items()}
    assert records["native"] > 25
    assert min(records.values()) > 0.7 * records["native"], records


def test_a_module_that_writes_its_lights_all_the_time_answers_every_poll(
    runs: dict[str, Run],
) -> None:
    for run in runs.values():
        assert run.manifest["summary"]["grid"]["polls_missed"] == 0
        with can.CanutilsLogReader(run.folder / "can.log") as log:
            kinds = [(frame.arbitration_id & 1, frame.data[0]) for frame in log]
        assert kinds.count((0, POLL)) == kinds.count((1, START)) > 15
