"""Modules with `grid.runtime = "original"` do as the published library's, natively and on chips."""

from pathlib import Path

import can
import pytest

from kilotwin.runs.reader import Run

from .conftest import Kilotwin
from .lab_module import RECEIVES

# As a lab's program: lights and messages of all cells in each pass of loop(), and a record for each
# tracking message. The type of a frame of the host that it is handed goes back.
MODULE = (
    RECEIVES
    + """\
static volatile uint8_t handed;
static void take(CAN_message_t *frame) { handed = frame->data[0]; }
static void setup(void) {}
static void loop(void) {
    for (uint8_t cell = 0; cell < N_CELLS; cell++) {
        IR_message_t message;
        init_IR_message(&message);
        message.type = 1;
        set_LED((cell_num_t)cell, RED);
        set_IR_message(&message, (cell_num_t)cell);
    }
    if (handed == 0) return;
    CAN_message_t frame;
    init_CAN_message(&frame);
    frame.header.length = 8;
    frame.data[1] = handed;
    handed = 0;
    kilogrid_address_t host = {module_uid_x_coord, module_uid_y_coord, ADDR_DISPATCHER};
    CAN_message_tx(&frame, host);
}
int main(void) {
    module_init();
    module_IR_message_rx = receive;
    module_CAN_message_rx = take;
    module_start(setup, loop);
}
"""
)

EXPERIMENT = """
name = "original modules"
duration_s = 10

[grid]
columns = 2
rows = 1
buses = 1
program = "module.c"
configuration = "cells.kconf"
runtime = "original"
health = true

[swarm]
profile = "kilobot"
program = "experiments/kilogrid/random_walk.c"
size = 2

[states]
green = "green"
"""
CELLS = "address\nmodule:0-0,1-0\n\ndata\n00\n01\n02\n03\n"
USER, HEALTH, START, POLL = 0x00, 0x13, 0x14, 0x15


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory, kilotwin: Kilotwin) -> dict[str, Run]:
    folder = tmp_path_factory.mktemp("original")
    for name, text in (("module.c", MODULE), ("cells.kconf", CELLS), ("grid.toml", EXPERIMENT)):
        (folder / name).write_text(text)

    def run(name: str, *words: str) -> Run:
        kilotwin("run", folder / "grid.toml", "--out", folder / name, "--quiet", *words)
        return Run.open(folder / name)

    return {
        "native": run("native"),
        "avr": run("avr", "--set", "grid.cpu=avr"),
        "ours": run("ours", "--set", "grid.runtime=kilotwin"),
    }


def frames(folder: Path) -> list[tuple[bool, bytes]]:
    """Whether each is the host's, and its bytes."""
    with can.CanutilsLogReader(folder / "can.log") as log:
        return [(not frame.arbitration_id & 1, bytes(frame.data)) for frame in log]


@pytest.mark.parametrize("cpu", ["native", "avr"])
def test_they_answer_every_poll(runs: dict[str, Run], cpu: str) -> None:
    run = runs[cpu]
    assert run.manifest["summary"]["grid"]["polls_missed"] == 0
    kinds = [(from_host, data[0]) for from_host, data in frames(run.folder)]
    assert kinds.count((True, POLL)) == kinds.count((False, START)) > 30
    assert len(run.tracking()) > 0


@pytest.mark.parametrize("cpu", ["native", "avr"])
def test_what_is_ours_alone_is_handed_to_the_program(runs: dict[str, Run], cpu: str) -> None:
    """The host asks for health after the set-up; the program says in USER what it was handed."""
    said = frames(runs[cpu].folder)
    assert any(from_host and data[0] == HEALTH for from_host, data in said)
    assert not any(not from_host and data[0] == HEALTH for from_host, data in said)
    assert any(not from_host and data[:2] == bytes((USER, HEALTH)) for from_host, data in said)


def test_ours_answer_what_is_ours(runs: dict[str, Run]) -> None:
    said = frames(runs["ours"].folder)
    assert any(not from_host and data[0] == HEALTH for from_host, data in said)
    assert not any(not from_host and data[:2] == bytes((USER, HEALTH)) for from_host, data in said)
