"""A record whose buses go away says so at once, ends if none is left, and never looks whole."""

import errno
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import pytest
from typer.testing import CliRunner, Result

from kilotwin.commands.cli import app
from kilotwin.errors import DeviceError, RunError
from kilotwin.runs.grid_record import GridRecord
from kilotwin.runs.reader import Run
from kilotwin.session import recording as live
from kilotwin.table.can.buses import BusName, OpenBus
from kilotwin.table.grid import console
from kilotwin.table.links.preflight import check_before_record
from kilotwin.table.links.readiness import Finding

from ..conftest import GRID

SPEED = "40"


class DumbBus(can.BusABC):
    """Takes what it is sent, so many frames, and is then gone."""

    def __init__(self, frames: float) -> None:
        super().__init__(channel="dumb")
        self._left = frames

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._left -= 1
        if self._left < 0:
            raise can.CanOperationError("gone")

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        return None, False


def open_dumb(frames: list[float]) -> Any:
    def open_all(names: list[BusName]) -> list[OpenBus]:
        opened = zip(names, frames, strict=True)
        return [OpenBus(DumbBus(count), str(name.channel), echoes=False) for name, count in opened]

    return open_all


def record(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    frames: list[float],
    *more: str,
    check: Callable[..., list[Finding]] = lambda *_, **__: [],
) -> Result:
    (folder / "grid.toml").write_text(GRID)
    monkeypatch.chdir(folder)
    monkeypatch.setattr(live, "open_all", open_dumb(frames))
    # Here modules never answer, which is another trouble.
    monkeypatch.setattr(GridRecord, "failed_modules", lambda *_: [])
    monkeypatch.setattr(live, "check_before_record", check)
    words = ["record", "grid.toml", "--can", "socketcand:h", "--speed", SPEED, "--out", "r", "-q"]
    return CliRunner().invoke(app, [*words, *more, "--set", "duration_s=40", "--json"])


def test_a_record_ends_when_no_bus_is_left(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done = record(folder, monkeypatch, [40, 40])
    assert done.exit_code == 1
    said = done.stderr.splitlines()
    assert "bus 0 is down (gone): its modules, rows 0 to 2, are neither polled nor told" in said[0]
    assert "no bus is left: the record ends" in said[2]
    assert "on bus 0, 1 could not be told to stop" in said[3]
    assert said[-1].startswith("ROBOTS MAY BE DRIVING ON")
    both = "--can socketcand:h:29536/can0 --can socketcand:h:29536/can1 --size 4x6"
    assert said[-1].endswith(f"kilotwin grid idle {both}")
    summary = json.loads(done.stdout)
    assert summary["status"] == "failed"
    assert summary["recorded_s"] <= 40
    run = Run.open(folder / "r")
    assert run.manifest["exit_code"] == 1
    assert run.manifest["reason"].startswith("no bus was left at ")
    assert [event["kind"] for event in run.events()][-1] == "not_idle"


def test_a_record_goes_on_with_the_buses_that_are_left_and_lists_the_lost(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = record(folder, monkeypatch, [float("inf"), 40])
    assert done.exit_code == 4
    summary = json.loads(done.stdout)
    assert (summary["status"], summary["recorded_s"]) == ("finished", 40)
    lost = "socketcand:h:29536/can1"
    assert summary["grid"]["buses_down"] == [{"bus": 1, "name": lost, "what": "gone"}]
    assert summary["grid"]["not_idle"] == [lost]
    assert f"{lost} is down: gone" in done.stderr.splitlines()
    assert f"ROBOTS MAY BE DRIVING ON: those of {lost} could not" in done.stderr


def test_a_record_is_refused_before_it_begins_while_modules_are_silent(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    check = check_before_record
    done = record(folder, monkeypatch, [float("inf")] * 2, check=check)
    assert (type(done.exception), done.exit_code) == (RunError, 1)
    assert str(done.exception).startswith("modules: 0 of 24 answer; silent: 0-0, 0-1, ")
    assert str(done.exception).endswith("; or add --force")
    assert not (folder / "r").exists()
    done = record(folder, monkeypatch, [float("inf")] * 2, "--force", check=check)
    assert done.exit_code == 0
    assert "modules: 0 of 24 answer" in done.stderr
    assert (folder / "r").exists()


def test_a_record_on_a_full_disk_leaves_robots_idle_and_a_manifest_that_says_so(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "no space left on device")

    monkeypatch.setattr(GridRecord, "flush", full)
    done = record(folder, monkeypatch, [float("inf"), float("inf")])
    assert done.exit_code == 1
    said = str(done.exception)
    assert said == "r: cannot write (no space left on device); robots and modules are idle now"
    manifest = json.loads((folder / "r/manifest.json").read_text())
    assert (manifest["status"], manifest["exit_code"]) == ("failed", 1)
    assert manifest["reason"] == "cannot write (no space left on device)"


def test_a_bus_that_goes_down_under_an_order_by_hand_is_a_missing_device(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(console, "open_all", open_dumb([3, float("inf")]))
    names = ["socketcan:can0", "socketcan:can1"]
    with (
        console.Console.open(names, "4x4", None) as grid,
        pytest.raises(DeviceError, match=r"--can can0: gone; .*type this again"),
    ):
        grid.idle()
