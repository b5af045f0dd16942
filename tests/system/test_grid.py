"""Experiments on an emulated Kilogrid: what the host records is what the robots did."""

import signal
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
from numpy.typing import NDArray

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import parse_setting
from kilotwin.programs.group import build_group
from kilotwin.runs.reader import Run
from kilotwin.session.job import Job
from kilotwin.session.worker import simulate
from kilotwin.table.grid import kilodat

from .conftest import KILOTWIN, ROOT, Kilotwin
from .served_table import Table

SMALL = "tests/system/grid_small.toml"
# A cell hears robots this near to its middle, by grid.cells; a robot walks 1.3 cm/s, pushed or not,
# and the host has its report at the next poll.
HEARD_M = 0.046
UPLINK_S = 1.5
FAST_M_S = 0.02


RunSmall = Callable[..., Run]


@pytest.fixture(scope="module")
def run_small(tmp_path_factory: pytest.TempPathFactory) -> RunSmall:
    """`run_small("key=value", ..., expect=0)`: a run as `kilotwin run` makes it, but here."""

    def run_small(*settings: str, expect: int = 0) -> Run:
        folder = tmp_path_factory.mktemp("grid")
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(ROOT)
            experiment = Experiment.load(Path(SMALL), map(parse_setting, settings))
            guests = [str(build_group(group).file) for group in experiment.groups]
            assert experiment.modules is not None
            modules = str(build_group(experiment.modules).file)
        (folder / "black_box").write_bytes(bytes(4096))
        job = Job(experiment, guests, folder / "run", {}, str(folder / "black_box"), modules)
        reports: list[dict[str, Any]] = []
        simulate(job, reports.append, lambda: False)
        assert reports[-1]["exit_code"] == expect, reports[-1]
        return Run.open(folder / "run")

    return run_small


@pytest.fixture(scope="module")
def plain(run_small: RunSmall) -> Run:
    """The experiment as it stands."""
    return run_small()


def tracks(run: Run) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times [k], and places [k, robots, 2] of the emulator's own record."""
    table = run.robots()
    robots = run.robots_number
    places = np.stack([table["x_m"].to_numpy(), table["y_m"].to_numpy()], axis=1)
    return table["time_s"].to_numpy()[::robots], places.reshape(-1, robots, 2)


def farthest_m(truth: Run, recorded: Run, late_s: float = UPLINK_S) -> float:
    """Largest distance in all reports of a robot from the cell, at best in the time before."""
    times, places = tracks(truth)
    reports = recorded.tracking().to_pylist()
    assert len(reports) > 30
    distances = []
    for report in reports:
        near = (times >= report["time_s"] - late_s) & (times <= report["time_s"] + 0.5)
        there = places[near, report["robot"]]
        if len(there):
            cell = (report["x_m"], report["y_m"])
            distances.append(float(np.hypot(*(there - cell).T).min()))
    return max(distances)


def kinds(run: Run) -> list[str]:
    return [event["kind"] for event in run.events()]


def test_reports_agree_with_where_the_robots_were(plain: Run) -> None:
    run = plain
    assert farthest_m(run, run) < HEARD_M + 0.5 * FAST_M_S
    grid = run.manifest["summary"]["grid"]
    assert grid["polls_missed"] == 0
    assert grid["bad_frames"] == 0
    assert kinds(run) == ["set_up", "configure", "run", "idle"]


def test_states_in_reports_are_those_that_robots_show(plain: Run) -> None:
    run = plain
    states: dict[int, list[tuple[float, str]]] = {}
    strange = 0
    for row in run.robots().to_pylist():
        states.setdefault(row["robot"], []).append((row["time_s"], row["state"]))
    for report in run.tracking().to_pylist():
        around = {
            state
            for time_s, state in states[report["robot"]]
            if report["time_s"] - UPLINK_S - 0.5 <= time_s <= report["time_s"] + 0.5
        }
        strange += bool(around) and report["state"] not in around
    # A state may be shorter than the time from one sample to the next.
    assert strange <= 0.05 * len(run.tracking())


def test_the_kilodat_and_the_can_log_tell_the_same(plain: Run) -> None:
    run = plain
    rows = kilodat.read(Path(run.manifest["summary"]["grid"]["kilodat"]))
    reports = run.tracking().to_pylist()
    assert [(row.x, row.y, row.cell, row.data) for row in rows] == [
        (report["module_x"], report["module_y"], report["cell"], report["data"])
        for report in reports
    ]
    with can.CanutilsLogReader(run.folder / "can.log") as log:
        frames = list(log)
    tracking = [f for f in frames if f.arbitration_id & 1 and f.data[0] & 0x3F == 0x11]
    assert [bytes(frame.data[1:]) for frame in tracking] == [row.data for row in rows]
    assert [frame.timestamp for frame in frames] == sorted(frame.timestamp for frame in frames)


def test_the_same_seed_gives_the_same_frames(run_small: RunSmall) -> None:
    one, other = (run_small("duration_s=20") for _ in range(2))
    assert (one.folder / "can.log").read_bytes() == (other.folder / "can.log").read_bytes()
    assert one.tracking().equals(other.tracking())


def test_sites_are_the_cells_whose_middles_lie_inside(run_small: RunSmall) -> None:
    """A site of 1 cm around a cell's middle is the whole cell of 5 cm."""
    small = ["site.0.width_m=0.01", "site.0.height_m=0.01", "site.0.centre_m=[-0.125, 0.025]"]
    run = run_small(*small, "duration_s=60")
    on = [row for row in run.robots().to_pylist() if row["site"] == "black"]
    assert on
    assert all(-0.15 <= r["x_m"] <= -0.10 and 0 <= r["y_m"] <= 0.05 for r in on)
    assert any(abs(r["x_m"] + 0.125) > 0.006 for r in on)


def test_sites_that_swap_swap_for_robots_and_records(run_small: RunSmall) -> None:
    change = 'grid.change=[{at_s = 30.0, swap = ["black", "white"]}]'
    run = run_small(change)
    assert "change" in kinds(run)
    for row in run.robots().to_pylist():
        if row["site"] is None or abs(row["time_s"] - 30.0) < 1:
            continue
        left = "black" if row["time_s"] < 30 else "white"
        assert row["site"] == (left if row["x_m"] < 0 else {"black": "white"}.get(left, "black"))
    # The site that robots say they stand on, some seconds after the cells have changed.
    said = [r for r in run.tracking().to_pylist() if r["time_s"] > 36 and r["data"][3]]
    assert said
    wrong = sum((r["x_m"] < 0) != (r["data"][3] == 2) for r in said)
    assert wrong <= 0.1 * len(said)


def test_robots_pause_and_go_on(run_small: RunSmall) -> None:
    commands = 'command=[{at_s = 20.0, send = "pause"}, {at_s = 40.0, send = "run"}]'
    run = run_small(commands, "grid.rounds=10")  # in two a robot may miss it
    assert [kind for kind in kinds(run) if kind in ("pause", "resume")] == ["pause", "resume"]
    times, places = tracks(run)
    still = (times > 25) & (times < 39)
    assert np.abs(np.diff(places[still], axis=0)).max() < 1e-3
    assert np.abs(np.diff(places[times > 45], axis=0)).max() > 1e-3
    assert any(r["time_s"] > 46 for r in run.tracking().to_pylist())


FAULT = 'faults.module=[{{at_s = 20.0, kind = "{kind}", module = [1, 1]}}]'


def of_module(run: Run, kind: str) -> list[dict[str, Any]]:
    return [e for e in run.events() if e["kind"] == kind and e["module"] == [1, 1]]


def reports_of_others(run: Run, after_s: float) -> int:
    return sum(
        r["time_s"] > after_s and (r["module_x"], r["module_y"]) != (1, 1)
        for r in run.tracking().to_pylist()
    )


def test_a_dead_module_is_reported_and_nothing_else_is_lost(run_small: RunSmall) -> None:
    run = run_small(FAULT.format(kind="dead"), expect=4)
    (silent,) = of_module(run, "module_silent")
    assert 20 < silent["time_s"] < 25
    assert [e["kind"] for e in run.events() if "module" in e] == ["module_silent"]
    failed = run.manifest["summary"]["grid"]["modules_failed"]
    assert [entry["module"] for entry in failed] == [[1, 1]]
    assert reports_of_others(run, 25) > 20


@pytest.mark.parametrize("health", ["true", "false"])
def test_a_module_that_is_reset_is_configured_again(run_small: RunSmall, health: str) -> None:
    run = run_small(FAULT.format(kind="reset"), f"grid.health={health}")
    (again,) = of_module(run, "module_configured_again")
    # Without its health it has to answer four polls as an idle one does.
    assert 20 < again["time_s"] < (24 if health == "true" else 27)
    assert [e["module"] for e in run.events() if "module" in e] == [[1, 1]]
    heard = [
        r["time_s"] for r in run.tracking().to_pylist() if (r["module_x"], r["module_y"]) == (1, 1)
    ]
    assert any(time_s > again["time_s"] + 1 for time_s in heard)


def test_a_node_that_goes_off_its_bus_is_found_again(run_small: RunSmall) -> None:
    faults = (
        'faults.module=[{at_s = 20.0, kind = "bus_off", module = [1, 1]},'
        '{at_s = 35.0, kind = "recover", module = [1, 1]}]'
    )
    run = run_small(faults, 'record.also=["modules"]')
    (silent,), (back,) = of_module(run, "module_silent"), of_module(run, "module_back")
    assert 20 < silent["time_s"] < 25
    assert 35 < back["time_s"] < 46
    assert reports_of_others(run, 20) > 30
    modules = run.modules().to_pylist()
    assert {row["tick"] for row in modules} == set(run.sites()["tick"].to_pylist())
    off = {(row["x"], row["y"], row["time_s"]) for row in modules if row["can"] == "bus_off"}
    assert {(x, y) for x, y, _ in off} == {(1, 1)}
    assert 20 <= min(time_s for *_, time_s in off) < 20.6
    assert 34.4 < max(time_s for *_, time_s in off) < 36


def test_error_frames_cost_time_and_no_reports(run_small: RunSmall, plain: Run) -> None:
    run = run_small("faults.error_share=0.05", 'record.also=["modules"]')
    errors = run.modules()["tec"].to_numpy()
    assert errors[:16].max() == 0  # at the begin
    assert 8 <= errors.max() < 128
    buses = run.manifest["summary"]["grid"]["buses"]
    for bus in buses:
        share = bus["error_frames"] / (bus["frames"] + bus["error_frames"])
        assert 0.03 < share < 0.07
    assert "module_silent" not in kinds(run)
    assert len(run.tracking()) > 0.8 * len(plain.tracking())
    assert run.manifest["summary"]["grid"]["bad_frames"] == 0


def test_a_host_that_vanishes_and_returns_goes_on(run_small: RunSmall) -> None:
    run = run_small("faults.host=[{from_s = 20.0, until_s = 40.0}]")
    assert kinds(run) == ["set_up", "configure", "run", "host_away", "host_back", "idle"]
    times = np.array([r["time_s"] for r in run.tracking().to_pylist()])
    assert not ((times > 21) & (times < 40)).any()
    assert (times > 40).sum() > 20
    # The robots have not noticed.
    moments, places = tracks(run)
    away = (moments > 22) & (moments < 38)
    assert np.abs(places[away][-1] - places[away][0]).max() > 0.01


@pytest.fixture
def tables() -> Iterator[list[Table]]:
    opened: list[Table] = []
    yield opened
    for table in opened:
        table.close()


@pytest.mark.waits
def test_a_host_in_another_process_records_what_the_robots_do(
    kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path, tables: list[Table]
) -> None:
    late = ["--set", "grid.poll_timeout_s=5"]  # no answer is, on a busy machine
    settings = ["--set", "duration_s=25", *late, "--speed", "2"]
    table = Table(SMALL, tmp_path, environment, *settings)
    tables.append(table)
    kilotwin("record", SMALL, "--can", table.bus, *settings, "--out", tmp_path / "recorded", "-q")
    assert table.process.wait(600) == 0
    truth, recorded = Run.open(table.out), Run.open(tmp_path / "recorded")
    assert kinds(recorded) == ["set_up", "configure", "run", "idle"]
    # Two clocks, and a machine that may be busy.
    assert farthest_m(truth, recorded, late_s=3.0) < HEARD_M + 0.5 * FAST_M_S
    assert len(recorded.robots()) == 12 * (25 * 2 + 1) or len(recorded.robots()) % 12 == 0
    logs = [(run.folder / "can.log").read_text().splitlines() for run in (truth, recorded)]
    served, ours = (sorted(line.split(" ", 1)[1] for line in log) for log in logs)
    # Before it begins to record, the host looks at the table.
    assert not Counter(ours) - Counter(served)
    assert len(served) - len(ours) < 8 * 16


def wait_for_run(out: Path) -> None:
    deadline = time.monotonic() + 600
    while time.monotonic() < deadline and "run" not in (
        [
            line.split('"kind": "')[1].split('"')[0]
            for line in (out / "events.jsonl").read_text().splitlines()
        ]
        if (out / "events.jsonl").exists()
        else []
    ):
        time.sleep(0.1)


@pytest.mark.waits
def test_ctrl_c_leaves_robots_and_modules_idle_and_the_log_whole(
    kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path, tables: list[Table]
) -> None:
    words = ["--set", "duration_s=100000", "--speed", "2"]
    table = Table(SMALL, tmp_path, environment, *words)
    tables.append(table)
    out = tmp_path / "recorded"
    host = subprocess.Popen(
        [KILOTWIN, "record", SMALL, "--can", table.bus, *words, "--out", out, "-q"],
        cwd=ROOT,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    wait_for_run(out)
    time.sleep(2)
    host.send_signal(signal.SIGINT)
    assert host.wait(600) == 130
    recorded = Run.open(out)
    assert recorded.manifest["status"] == "interrupted"
    assert kinds(recorded)[-1] == "idle"
    assert (out / "can.log").read_text().endswith("\n")
    said = kilotwin("grid", "health", "--can", table.bus, "--can", table.bus, expect=2)
    assert "which bus?" in said.stderr
    buses = [word for n in range(2) for word in ("--can", f"{table.bus}/can{n}")]
    said = kilotwin("grid", "health", *buses, "--size", "4x4")
    assert said.stdout.splitlines()[0] == "16 modules are IDLE"


@pytest.mark.waits
def test_a_table_that_vanishes_ends_the_record_and_alarms(
    environment: dict[str, str], tmp_path: Path, tables: list[Table]
) -> None:
    words = ["--set", "duration_s=100000", "--speed", "4"]
    table = Table(SMALL, tmp_path, environment, *words)
    tables.append(table)
    out = tmp_path / "recorded"
    words += ["--can", table.bus, "-q"]
    with subprocess.Popen(
        [KILOTWIN, "record", SMALL, "--out", out, *words],
        cwd=ROOT,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as host:
        wait_for_run(out)
        table.close()
        _, said = host.communicate(timeout=600)
    assert host.returncode == 1
    assert "no bus is left: the record ends" in said
    assert "ROBOTS MAY BE DRIVING ON" in said
    recorded = Run.open(out)
    assert recorded.manifest["status"] == "failed"
    assert kinds(recorded)[-3:] == ["bus_down", "bus_down", "not_idle"]
