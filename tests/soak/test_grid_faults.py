"""Faults of a Kilogrid by the hundred: what a lab's record loses by them is what its events say."""

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import pytest
from tests.kept_table import ROOT
from tests.system.conftest import KILOTWIN

from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.reader import Run
from kilotwin.session.emulated_grid import lead_ticks
from kilotwin.units import seconds

TABLE = """
name = "faults by the hundred"
duration_s = {duration_s}

[grid]
columns = {columns}
rows = {rows}
buses = {buses}
wall_cells = 0
cpu = "{cpu}"
health = true

[swarm]
profile = "kilobot"
program = "experiments/kilogrid/random_walk.c"
size = {robots}

[states]
straight = "green"
left = "red"
right = "blue"

[record]
sample_s = 60
"""
FAULT = '[[faults.module]]\nat_s = {at_s:.3f}\nkind = "{kind}"\nmodule = [{x}, {y}]\n'
Module = tuple[int, int]
# A module's power-up takes 1.2 s; then it has to be noticed, and set up again. Others are polled
# each 0.4 s; what collides on their bus, or is late, comes with the next poll.
RESET_OVER_S, POLLED_S = 3.0, 1.0


def run(folder: Path, table: str, faults: Iterator[str]) -> Run:
    """`kilotwin run` of this table with these faults."""
    experiment = folder / "faults.toml"
    experiment.write_text(table + "\n" + "\n".join(faults))
    command = [KILOTWIN, "run", experiment, "--out", folder / "run", "--quiet", "--no-twin"]
    done = subprocess.run(
        list(map(str, command)), cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return Run.open(folder / "run")


def of_kind(run: Run, kind: str) -> list[tuple[float, Module]]:
    """Events about modules: when, and which."""
    return [(e["time_s"], tuple(e["module"])) for e in run.events() if e["kind"] == kind]


def answers(run: Run) -> Iterator[tuple[float, Module]]:
    """Frames of modules to the host after t = 0, in order of time; the log begins at power-up."""
    lead_s = seconds(lead_ticks(Experiment.load(run.folder.parent / "faults.toml")))
    with can.CanutilsLogReader(run.folder / "can.log") as log:
        for frame in log:
            number, at_s = frame.arbitration_id, frame.timestamp - lead_s
            if number & 1 and at_s > 0:
                yield at_s, ((number >> 1 & 0x1F) - 1, (number >> 6) - 1)


def lost(grid: dict[str, Any], kind: str) -> int:
    return sum(bus[f"lost_{kind}"] for bus in grid["buses"])


@pytest.mark.long
@pytest.mark.parametrize(("cpu", "columns", "rows"), [("native", 5, 4), ("avr", 2, 2)])
def test_after_each_of_100_bus_offs_a_module_is_back_within_a_second(
    cpu: str, columns: int, rows: int, tmp_path: Path
) -> None:
    modules = [(x, y) for y in range(rows) for x in range(columns)]
    off = [(5 + 1.5 * i, modules[i % len(modules)]) for i in range(100)]
    # The controller is off for a tenth of a second, and takes 6 ms more to come back.
    faults = (
        FAULT.format(at_s=at_s + later_s, kind=kind, x=x, y=y)
        for at_s, (x, y) in off
        for later_s, kind in ((0.0, "bus_off"), (0.1, "recover"))
    )
    table = TABLE.format(
        duration_s=160, columns=columns, rows=rows, buses=2, cpu=cpu, robots=len(modules) // 2
    )
    done = run(tmp_path, table, faults)
    times: dict[Module, list[float]] = {module: [] for module in modules}
    for at_s, module in answers(done):
        times[module].append(at_s)
    for at_s, module in off:
        assert any(at_s + 0.1 < time_s < at_s + 1.1 for time_s in times[module]), (at_s, module)
    grid = done.manifest["summary"]["grid"]
    assert sum(bus["went_bus_off"] for bus in grid["buses"]) == 100
    assert grid["modules_failed"] == []
    assert of_kind(done, "module_silent") == []
    # What was under way in such a module is lost, and counted.
    assert lost(grid, "queue_full") == lost(grid, "dead") == 0


@pytest.mark.long
def test_200_modules_that_are_reset_once_each_lose_nothing_but_what_is_said(
    tmp_path: Path,
) -> None:
    columns, rows = 10, 20
    modules = [(x, y) for y in range(rows) for x in range(columns)]
    resets = {module: 20 + 17.5 * i for i, module in enumerate(modules)}
    faults = (FAULT.format(at_s=at_s, kind="reset", x=x, y=y) for (x, y), at_s in resets.items())
    table = TABLE.format(
        duration_s=3600, columns=columns, rows=rows, buses=4, cpu="native", robots=100
    )
    done = run(tmp_path, table, faults)
    # Each module is named once, soon after its reset, and nothing else is.
    again = of_kind(done, "module_configured_again")
    assert sorted(module for _, module in again) == sorted(modules)
    for at_s, module in again:
        assert resets[module] < at_s < resets[module] + RESET_OVER_S, (at_s, module)
    said = {event["kind"] for event in done.events() if "module" in event}
    assert said <= {"module_configured_again", "module_silent", "module_back"}
    for kind in ("module_silent", "module_back"):
        for at_s, module in of_kind(done, kind):
            assert resets[module] < at_s < resets[module] + RESET_OVER_S, (kind, at_s, module)
    # All of them answer at all other times.
    last = dict.fromkeys(modules, 0.0)
    for at_s, module in answers(done):
        gap_s = at_s - last[module]
        reset_s = resets[module]
        resets_now = last[module] <= reset_s + RESET_OVER_S and at_s > reset_s
        assert gap_s < (RESET_OVER_S if resets_now else POLLED_S), (at_s, module)
        last[module] = at_s
    assert min(last.values()) > 3595
    grid = done.manifest["summary"]["grid"]
    assert grid["modules_failed"] == []
    assert grid["bad_frames"] == 0
    assert lost(grid, "queue_full") == lost(grid, "bus_off") == 0
    # Reports that waited for the next poll of a module are gone with it: less than one a reset.
    assert 0 <= grid["cells"]["received"] - grid["reports"] < len(modules)
    print(json.dumps({key: value for key, value in grid.items() if key != "buses"}))
