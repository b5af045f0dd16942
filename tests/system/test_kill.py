"""A run that is killed at any moment leaves a folder that can be read and plotted."""

import contextlib
import json
import os
import random
import re
import signal
import subprocess
import time
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import pyarrow as pa
import pytest
from tests.processes import alive, children, stat

from .conftest import KILOTWIN, ROOT, SIMPLIFIED, Kilotwin

SEED = 20261121
Process = subprocess.Popen[str]


def wait_for(condition: Callable[[], object], what: str, limit_s: float = 600) -> None:
    end = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < end, f"waited {limit_s} s for {what}"
        time.sleep(0.005)


@pytest.fixture
def long_run(environment: dict[str, str], tmp_path: Path) -> Iterator[Process]:
    """A run of hours in a process group of its own; what is left of it ends with the test."""
    settings = ["--set", "duration_s=1000000", "--out", str(tmp_path / "run"), "--json"]
    with subprocess.Popen(
        [str(KILOTWIN), "run", SIMPLIFIED, *settings],
        cwd=ROOT,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        yield process
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def whole_batches(path: Path) -> int:
    """How many batches a reader gets before the end, clean or torn."""
    count = 0
    with contextlib.suppress(pa.ArrowInvalid, OSError):
        for _ in pa.ipc.open_stream(path):
            count += 1
    return count


def assert_readable(folder: Path) -> None:
    json.loads((folder / "manifest.json").read_text())
    tomllib.loads((folder / "experiment.toml").read_text())
    for line in (folder / "events.jsonl").read_text().splitlines()[:-1]:
        json.loads(line)


@pytest.mark.parametrize("moment_s", random.Random(SEED).sample([0.0, 0.3, 0.8, 1.3, 1.9, 2.6], 3))
def test_a_killed_run_can_be_plotted(
    moment_s: float, long_run: Process, kilotwin: Kilotwin, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    wait_for((folder / "robots.arrows").exists, "the run folder")
    wait_for(lambda: whole_batches(folder / "robots.arrows") > 0, "a first batch")
    engine = children(long_run.pid)
    time.sleep(moment_s)  # the moment is what this test is about
    long_run.kill()
    long_run.wait()
    wait_for(lambda: not any(map(alive, engine)), "the engine to end with its parent")
    assert_readable(folder)
    kilotwin("plot", "timeline", folder, "-o", tmp_path / "timeline.png")
    assert (tmp_path / "timeline.png").stat().st_size > 0


HANGS = """\
#include <kilolib.h>
static void setup(void) {}
static void loop(void) {
    if (kilo_uid == 2) __asm__ volatile("nop; .byte 0xeb, 0xfd");  // a loop that nothing counts
}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
HANGING = """\
duration_s = 60
arena.diameter_m = 2.0
[swarm]
profile = "kilobot"
cpu = "native"
[[robots]]
program = "hangs.c"
count = 3
"""


@pytest.fixture
def hanging(tmp_path: Path) -> Path:
    """An experiment in which robot 1 hangs at once."""
    (tmp_path / "hangs.c").write_text(HANGS)
    file = tmp_path / "hanging.toml"
    file.write_text(HANGING)
    return file


def descendants(pid: int) -> list[int]:
    return [each for child in children(pid) for each in (child, *descendants(child))]


@pytest.mark.parametrize("command", ["run", "sweep"])
def test_no_process_is_left_of_a_killed_command_whose_robot_hangs(
    command: str, hanging: Path, environment: dict[str, str], tmp_path: Path
) -> None:
    file = hanging
    if command == "sweep":
        file = tmp_path / "sweep.toml"
        file.write_text('base = "hanging.toml"\n')
    words = [str(KILOTWIN), command, str(file), "--out", str(tmp_path / "out")]
    with subprocess.Popen(words, env=environment, stderr=subprocess.DEVNULL) as process:
        try:
            wait_for(lambda: any(map(computes, descendants(process.pid))), "a robot that hangs")
            left = descendants(process.pid)
        finally:
            process.kill()
    wait_for(lambda: not any(map(alive, left)), "all processes to end")


def computes(pid: int) -> bool:
    """Whether it has used more CPU time than a start takes."""
    fields = stat(pid)
    return bool(fields) and int(fields[11]) > 2 * os.sysconf("SC_CLK_TCK")


def test_a_robot_that_hangs_is_named_and_the_others_go_on(
    hanging: Path, kilotwin: Kilotwin, tmp_path: Path
) -> None:
    done = kilotwin("run", hanging, "--out", tmp_path / "run", "--json", expect=4)
    (failed,) = json.loads(done.stdout)["robots_failed"]
    assert (failed["robot"], failed["kind"]) == (1, "endless")
    assert "5 s of CPU time" in done.stderr


def test_a_run_whose_engine_dies_is_closed_and_says_so(long_run: Process, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    wait_for(lambda: whole_batches(folder / "robots.arrows") > 0, "a first batch")
    (engine,) = children(long_run.pid)
    os.kill(engine, signal.SIGKILL)
    _, errors = long_run.communicate(timeout=600)
    assert long_run.returncode == 1, errors
    # A robot is named if the engine was executing one.
    ran = r"(; last to run was aggregation robot \d+ tick \d+)?"
    assert re.search(f"was ended by SIGKILL{ran}; what was recorded is in", errors), errors
    assert_readable(folder)


def test_an_interrupted_run_is_closed(long_run: Process, tmp_path: Path) -> None:
    """Ctrl-C reaches the whole group, as it does from a terminal."""
    folder = tmp_path / "run"
    wait_for(lambda: whole_batches(folder / "robots.arrows") > 0, "a first batch")
    os.killpg(long_run.pid, signal.SIGINT)
    long_run.communicate(timeout=600)
    assert long_run.returncode != 0
    assert_readable(folder)
