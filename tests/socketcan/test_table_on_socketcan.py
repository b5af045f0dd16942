"""`kilotwin record` and a whole emulated table on real SocketCAN; candump is the witness."""

import contextlib
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = [pytest.mark.socketcan, pytest.mark.long]

BUSES = ["vcan0", "vcan1", "vcan2", "vcan3"]
ROOT = Path(__file__).parents[2]
KILOTWIN = Path(sys.executable).with_name("kilotwin")
EXPERIMENT = "experiments/kilogrid/paper-n50.toml"
# 200 modules, polled every 0.8 s, after a short set-up; slow enough for a kernel within another.
SETTINGS = ["duration_s=6", "grid.hold_s=0.2", "grid.rounds=1"]
SPEED = "0.1"
PATIENCE_S = 600.0


def command(what: str, *words: str | Path) -> list[str | Path]:
    settings = [word for setting in SETTINGS for word in ("--set", setting)]
    return [KILOTWIN, what, EXPERIMENT, *settings, "--speed", SPEED, *words]


@contextlib.contextmanager
def candump(bus: str, log: Path) -> Iterator[None]:
    with log.open("w") as file:
        process = subprocess.Popen(["candump", "-L", "-r", str(8 << 20), bus], stdout=file)
        try:
            yield
        finally:
            time.sleep(0.5)  # for what is still in its buffer
            process.terminate()
            process.wait()


@contextlib.contextmanager
def table(folder: Path) -> Iterator["subprocess.Popen[bytes]"]:
    """The table, waiting on all four buses."""
    said = folder / "served.txt"
    cans = [word for bus in BUSES for word in ("--can", bus)]
    words = command("serve", "world", *cans, "--out", folder / "served")
    with said.open("w") as file:
        process = subprocess.Popen(words, cwd=ROOT, stdout=file, stderr=file)
    try:
        end = time.monotonic() + PATIENCE_S
        while "waits on" not in said.read_text():
            assert process.poll() is None, said.read_text()
            assert time.monotonic() < end, said.read_text()
            time.sleep(0.05)
        yield process
        assert process.wait(PATIENCE_S) == 0, said.read_text()
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()


def frames(log: Path, bus: str, *, to_host: bool) -> list[str]:
    """One direction's frames on a bus, in order; both logs are as `candump -L` writes them."""
    lines = [line.split() for line in log.read_text().splitlines()]
    # The lowest bit of an identifier tells modules from the host (hardware.md 3.2).
    return [
        frame
        for _, name, frame, *_ in lines
        if name == bus and int(frame.split("#")[0], 16) & 1 == to_host
    ]


def test_the_host_logs_what_candump_logs_frame_for_frame(tmp_path: Path) -> None:
    with contextlib.ExitStack() as stack:
        for bus in BUSES:
            stack.enter_context(candump(bus, tmp_path / bus))
        process = stack.enter_context(table(tmp_path))
        cans = [word for bus in BUSES for word in ("--can", f"socketcan:{bus}")]
        done = subprocess.run(
            command("record", *cans, "--out", tmp_path / "recorded"),
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE_S,
        )
        assert done.returncode == 0, done.stderr
        assert process.poll() in (None, 0)
    log = tmp_path / "recorded" / "can.log"
    total = 0
    for bus in BUSES:
        for to_host in (True, False):
            ours = frames(log, bus, to_host=to_host)
            # Before its log begins, the host asks the modules as `kilotwin grid check` does.
            assert frames(tmp_path / bus, bus, to_host=to_host)[-len(ours) :] == ours, bus
            total += len(ours)
    print(f"{total} frames")
    # 200 modules were asked and answered 7 times.
    assert total > 2 * 200 * 6
