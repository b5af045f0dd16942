"""`kilotwin record --via ohc:... --poses udp:...` against a served emulation, without hardware."""

import json
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kilotwin.commands import cli
from kilotwin.runs.reader import Run
from kilotwin.table.ports.pseudo_terminal import PseudoTerminal

from .conftest import KILOTWIN, ROOT, Kilotwin

pytestmark = pytest.mark.waits

EXAMPLES = ROOT / "experiments/environment"
WALL_M = 0.2
# Robots walk on while a busy machine thinks.
SPEED = ("--speed", "4")


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for file in EXAMPLES.iterdir():
        if file.is_file():
            shutil.copy(file, tmp_path)
    return tmp_path


@contextmanager
def served(folder: Path, environment: dict[str, str], port: int) -> Iterator[None]:
    """Robots and a camera above them, until they are not needed any more."""
    process = subprocess.Popen(
        [
            *(KILOTWIN, "serve", "world", "wall.toml", "--out", "emulated", "--link-ohc", "ohc"),
            *("--poses", f"udp:127.0.0.1:{port}", "--set", "duration_s=1000", *SPEED),
        ],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        deadline = time.monotonic() + 600
        while not (folder / "ohc").is_symlink():
            assert time.monotonic() < deadline
            assert process.poll() is None, process.communicate()
            time.sleep(0.05)
        yield
        process.send_signal(signal.SIGINT)
        _, notes = process.communicate(timeout=600)
        assert process.returncode == 130, notes
        assert f"a camera sends robots' poses to udp:127.0.0.1:{port}" in notes
    finally:
        process.kill()
        process.wait()


def distances(run: Run) -> "NDArray[np.float32]":
    table = run.robots()
    far: NDArray[np.float32] = np.hypot(table["x_m"].to_numpy(), table["y_m"].to_numpy())
    return far


def test_an_environment_is_played_to_robots_that_are_outside(
    folder: Path, environment: dict[str, str], kilotwin: Kilotwin
) -> None:
    port = free_port()
    with served(folder, environment, port):
        words = ("--via", f"ohc:{folder / 'ohc'}", "--poses", f"udp:127.0.0.1:{port}", *SPEED)
        shorter = ("--set", "duration_s=80")
        done = kilotwin(
            "record", folder / "wall.toml", *words, *shorter, "--out", folder / "out", "--json"
        )
    summary = json.loads(done.stdout)
    assert summary["status"] == "finished"
    assert summary["poses"]["never_seen"] == []
    assert summary["poses"]["bad_lines"] == summary["poses"]["strangers"] == 0
    told = summary["environment"]
    assert told["sent"] > 10
    assert told["latency_s"]["mean"] < 2
    run = Run.open(folder / "out")
    assert run.manifest["recorded_from"] == [f"ohc:{folder / 'ohc'}"]
    assert run.sent().num_rows == told["sent"]
    assert set(run.sent()["type"].to_pylist()) == {1}
    # Both folders have the same robots, and the wall held where they really were.
    emulated, recorded = distances(Run.open(folder / "emulated")), distances(run)
    assert emulated.max() < WALL_M + 0.1
    assert WALL_M < np.nanmax(recorded) < WALL_M + 0.1
    leds = set(run.robots()["state"].to_pylist())
    assert {"walks", "turned-back"} <= leds


@pytest.fixture
def table() -> Iterator[tuple[str, int]]:
    """A port that takes packets and does nothing, and an address for poses."""
    terminal = PseudoTerminal()
    yield terminal.port, free_port()
    terminal.close()


def record(folder: Path, table: tuple[str, int], *words: str) -> "subprocess.Popen[str]":
    port, poses = table
    via = ("--via", f"ohc:{port}", "--poses", f"udp:127.0.0.1:{poses}")
    return subprocess.Popen(
        [KILOTWIN, "record", "wall.toml", *via, "--out", "out", *words],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_lines_of_no_use_are_counted_and_told_and_robots_that_nobody_saw_are_named(
    folder: Path, table: tuple[str, int]
) -> None:
    robot = {"x_m": 0.01, "y_m": 0.0, "heading_rad": 0.0, "led": [0, 3, 0]}
    good = json.dumps({"robots": [{"uid": uid, **robot} for uid in (3, 4, 99)]})
    process = record(folder, table, "--set", "duration_s=3", "--json")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tracker:
        while process.poll() is None:
            for line in (good, "nonsense", json.dumps({"robots": [{"uid": "x"}]})):
                tracker.sendto(line.encode() + b"\n", ("127.0.0.1", table[1]))
            time.sleep(0.1)
    said, notes = process.communicate()
    assert process.returncode == 4, notes
    poses = json.loads(said)["poses"]
    assert poses["bad_lines"] == pytest.approx(2 / 3 * poses["lines"], abs=3)
    assert poses["strangers"] > 0
    assert poses["never_seen"] == [uid for uid in range(1, 16) if uid not in (3, 4)]
    assert re.search(
        r"at \d s: \d+ lines? of poses (is|are) of no use: (it is not JSON|uid is 'x')",
        notes,
    )
    events = (folder / "out/events.jsonl").read_text()
    assert '"kind": "poses"' in events


def test_a_mistake_of_the_program_pauses_robots_and_ends_with_its_line(
    folder: Path, table: tuple[str, int]
) -> None:
    (folder / "wall.py").write_text(
        "class WallOfLight:\n"
        "    def __init__(self, arena, settings):\n"
        "        arena.note('made')\n"
        "    def step(self, seen, send):\n"
        "        send(seen.robots[0].uid, 5000)\n"
    )
    robot = {"uid": 1, "x_m": 0.01, "y_m": 0.0, "heading_rad": 0.0}
    process = record(folder, table)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tracker:
        while process.poll() is None:
            line = json.dumps({"robots": [robot]}).encode()
            tracker.sendto(line, ("127.0.0.1", table[1]))
            time.sleep(0.1)
    _, notes = process.communicate()
    assert process.returncode == 1
    assert re.search(r"wall\.py:5: ValueError: value is 5000; it must be 0 to 1023", notes)
    assert "Traceback" not in notes
    manifest = json.loads((folder / "out/manifest.json").read_text())
    assert manifest["status"] == "failed"
    assert "wall.py:5" in manifest["reason"]
    assert '"text": "made"' in (folder / "out/events.jsonl").read_text()


ALL = ("--via", "ohc:{port}", "--poses", "udp:127.0.0.1:{poses}")
SOME = '\n[[command]]\nat_s = 1\nsend = "run"\nrobot = 2\n'
PLAIN = """
duration_s = 1
[arena]
diameter_m = 1.0
[swarm]
profile = "kilobot"
program = "walker.c"
size = 1
"""


@pytest.mark.parametrize(
    ("words", "said", "code"),
    [
        (["wall.toml", *ALL[:2]], "needs --poses udp:HOST:PORT; add it", 2),
        (["wall.toml", *ALL[2:]], "--poses needs --via ohc:PORT; add it", 2),
        (["wall.toml"], r"an \[environment\] goes by --via ohc:PORT and --poses", 2),
        (["wall.toml", *ALL[:2], "--poses", "5005"], "--poses 5005: write udp:HOST:PORT", 2),
        (["wall.toml", "--via", "grid", *ALL[2:]], "--via grid: allowed: ohc:PORT", 2),
        (["wall.toml", *ALL, "--join"], "--can and --join are a grid's", 2),
        (["plain.toml", *ALL], r"no \[environment\] to play", 2),
        (["some.toml", *ALL], r"some.toml:\d+: .*orders reach all robots; remove 'ro", 2),
        (
            ["wall.toml", *ALL, "--set", "environment.settings.radius_m=9"],
            r"wall.py:\d+: ValueError: radius_m is 9; .*\(WallOfLight, while it was made\)",
            2,
        ),
        (["wall.toml", "--via", "ohc:/dev/none", *ALL[2:]], "/dev/none", 3),
    ],
)
def test_what_does_not_go_together_is_refused(  # noqa: PLR0917 (fixtures)
    words: list[str],
    said: str,
    code: int,
    folder: Path,
    table: tuple[str, int],
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    (folder / "plain.toml").write_text(PLAIN)
    (folder / "some.toml").write_text((folder / "wall.toml").read_text() + SOME)
    given = [word.format(port=table[0], poses=table[1]) for word in words]
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "argv", ["kilotwin", "record", *given, "--out", "no"])
    with pytest.raises(SystemExit) as caught:
        cli.main()
    output, errors = capfd.readouterr()
    assert (caught.value.code, output) == (code, ""), errors
    assert re.search(said, errors), errors
    assert "Traceback" not in errors
    assert not (folder / "no").exists()
