"""A host that has nothing but a dispatcher's serial port; the emulated one of a served table."""

import json
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from kilotwin.runs.reader import Run

from .conftest import KILOTWIN, ROOT, Kilotwin

pytestmark = pytest.mark.waits

SMALL = "tests/system/grid_small.toml"
# No answer is too late on a busy machine.
SETTINGS = ("--set", "duration_s=20", "--set", "grid.poll_timeout_s=5", "--speed", "2")
LONG = "duration_s=100000"


@pytest.fixture
def table(
    request: pytest.FixtureRequest, tmp_path: Path, environment: dict[str, str]
) -> Iterator["subprocess.Popen[str]"]:
    """A served table; its dispatcher is at `dispatcher` in the test's folder. Its parameter: a
    setting more."""
    link = tmp_path / "dispatcher"
    out = tmp_path / "served"
    words = ["--link-dispatcher", str(link), "--out", str(out), *SETTINGS]
    if hasattr(request, "param"):
        words += ["--set", request.param]
    with subprocess.Popen(
        [str(KILOTWIN), "serve", "world", SMALL, *words],
        cwd=ROOT,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        deadline = time.monotonic() + 600
        while not link.is_symlink():
            assert time.monotonic() < deadline
            assert process.poll() is None
            time.sleep(0.05)
        yield process
        process.kill()


def test_an_experiment_is_recorded_through_a_dispatcher(
    table: "subprocess.Popen[str]", kilotwin: Kilotwin, tmp_path: Path
) -> None:
    bus = f"kilogrid:{tmp_path / 'dispatcher'}"
    said = kilotwin("grid", "ls", "--can", bus, "--size", "4x4").stdout
    assert said == "a dispatcher does not say which modules answer; 16 are taken to be there\n"
    recorded = tmp_path / "recorded"
    done = kilotwin("record", SMALL, "--can", bus, *SETTINGS, "--out", recorded, "--json", "-q")
    summary = json.loads(done.stdout)
    assert summary["status"] == "finished"
    assert summary["grid"]["buses"] == [bus]
    assert summary["grid"]["polls_missed"] == summary["grid"]["bad_frames"] == 0
    _, notes = table.communicate(timeout=600)
    assert table.returncode == 0
    assert f"--can {bus}, --via dispatcher:" in notes
    kinds = [event["kind"] for event in Run.open(recorded).events()]
    assert kinds == ["set_up", "configure", "run", "idle"]
    # The table's own log has what modules really said: all of it came through.
    log = (tmp_path / "served" / "can.log").read_text().split()
    frames = [word.partition("#")[2] for word in log]
    reports = [frame[2:] for frame in frames if frame[:2] in REPORT_TYPES]
    assert len(reports) > 12
    rows = Run.open(recorded).tracking().to_pylist()
    assert sorted(row["data"].hex().upper() for row in rows) == sorted(reports)
    assert {row["robot"] for row in rows} <= set(range(12))


# TRACKING_KILOBOT from cells 0 to 3.
REPORT_TYPES = {"11", "51", "91", "D1"}


@pytest.mark.parametrize("table", [LONG], indirect=True)
def test_orders_go_through_a_dispatcher(
    table: "subprocess.Popen[str]", kilotwin: Kilotwin, tmp_path: Path
) -> None:
    bus = ("--can", f"kilogrid:{tmp_path / 'dispatcher'}", "--size", "4x4")
    assert "modules are set up" in kilotwin("grid", "setup", SMALL, *bus[:2], "-q").stdout
    kilotwin("grid", "run", *bus)
    kilotwin("grid", "send", "voltage", "--hold-s", "0.5", *bus)
    kilotwin("grid", "idle", *bus)
    said = kilotwin("flash", "robots", "my.hex", "--via", "grid", *bus, expect=2).stderr
    assert "Traceback" not in said
    said = kilotwin("grid", "idle", *bus, "--can", "socketcan:can0", expect=2).stderr
    assert "a dispatcher has all buses; name nothing else" in said
    deadline = time.monotonic() + 600
    kinds: list[str] = []
    while kinds[-2:] != ["AA", "AA"]:
        assert time.monotonic() < deadline, kinds
        time.sleep(0.1)
        log = (tmp_path / "served" / "can.log").read_text().split()
        orders = [word.partition("#")[2] for word in log if word.startswith("000#")]
        kinds = [order[:2] for order in orders if order[:2] != "15"]
    # Run, voltage by both parts of a message, idle by both numbers.
    assert {"0D", "01", "02", "0B", "AA"} <= set(kinds)
    assert "0101000000870000" in orders
    assert kinds[-4:] == ["0B", "0B", "AA", "AA"]  # on two buses
