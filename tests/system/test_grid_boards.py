"""A grid whose modules run from their .hex: the same host, the same frames as with native ones."""

import subprocess
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import can
import pytest

from kilotwin.experiment.experiment import Experiment
from kilotwin.programs.group import build_group
from kilotwin.runs.reader import Run

from .conftest import KILOTWIN

# Without walls, so that a site's cells are close; short, for every module is a processor.
GRID = """
name = "modules of both kinds"
duration_s = 8

[grid]
columns = 2
rows = 2
buses = 2
wall_cells = 0
cpu = "native"
hold_s = 0.2
rounds = 1
health = true

[[site]]
name = "black"
shape = "rectangle"
centre_m = [-0.05, 0.0]
width_m = 0.1
height_m = 0.2

[swarm]
profile = "kilobot"

[[robots]]
program = "firmware/aggregation"
cpu = "avr"
count = 1
poses = [[-0.075, 0.075, 0]]

[[robots]]
program = "firmware/aggregation"
count = 3
poses = [[0.075, 0.075, 0], [-0.075, -0.075, 0], [0.075, -0.075, 0]]

[controller]
beta = 1.5

[record]
sample_s = 0.5
"""
MODULES = {(x, y) for x in (0, 1) for y in (0, 1)}
POLL, RECORD, START, HEALTH = 0x15, 0x11, 0x14, 0x13
UPTIME = slice(4, 6)

RunGrid = Callable[..., Run]


@pytest.fixture(scope="module")
def run_grid(tmp_path_factory: pytest.TempPathFactory) -> RunGrid:
    def run(*words: str) -> Run:
        folder = tmp_path_factory.mktemp("grid")
        (folder / "grid.toml").write_text(GRID)
        done = subprocess.run(
            [KILOTWIN, "run", folder / "grid.toml", "--out", folder / "run", "--quiet", *words],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return Run.open(folder / "run")

    return run


@pytest.fixture(scope="module")
def native(run_grid: RunGrid) -> Run:
    return run_grid()


@pytest.fixture(scope="module")
def boards(run_grid: RunGrid) -> Run:
    return run_grid("--set", "grid.cpu=avr")


def result(run: Run) -> str:
    return str(run.manifest["summary"]["result_hash"])


def frames(run: Run) -> list[can.Message]:
    with can.CanutilsLogReader(run.folder / "can.log") as log:
        return list(log)


def said_by_host(run: Run) -> list[tuple[str, int, bytes]]:
    """Frames that set the modules up, by bus, in order: polls come by the clock."""
    orders = [
        (str(frame.channel), frame.arbitration_id, bytes(frame.data))
        for frame in frames(run)
        if not frame.arbitration_id & 1 and frame.data[0] not in (POLL, HEALTH)
    ]
    return sorted(orders, key=lambda order: order[0])


def answers(run: Run, kind: int) -> list[can.Message]:
    return [f for f in frames(run) if f.arbitration_id & 1 and f.data[0] & 0x3F == kind]


def test_the_host_says_the_same_to_both(native: Run, boards: Run) -> None:
    assert said_by_host(native) == said_by_host(boards)


def test_both_answer_every_poll(native: Run, boards: Run) -> None:
    for run in (native, boards):
        grid = run.manifest["summary"]["grid"]
        assert grid["polls"] > 20
        assert grid["polls_missed"] == 0
        assert grid["bad_frames"] == 0
        assert grid["modules_failed"] == []
        kinds = [event["kind"] for event in run.events()]
        assert kinds == ["set_up", "configure", "run", "idle"]
    ids = [{frame.arbitration_id for frame in answers(run, START)} for run in (native, boards)]
    assert ids[0] == ids[1]
    assert ids[0] == {(y + 1) << 6 | (x + 1) << 1 | 1 for x, y in MODULES}


def test_records_come_as_they_were_announced(boards: Run) -> None:
    owed: Counter[int] = Counter()
    for frame in frames(boards):
        if not frame.arbitration_id & 1:
            continue
        if frame.data[0] == START:
            assert frame.dlc == 2
            assert owed[frame.arbitration_id] == 0
            owed[frame.arbitration_id] = frame.data[1]
        elif frame.data[0] & 0x3F == RECORD:
            assert frame.dlc == 8
            owed[frame.arbitration_id] -= 1
    assert set(owed.values()) == {0}
    assert {report["robot"] for report in boards.tracking().to_pylist()} <= {0, 1, 2, 3}
    assert len(boards.tracking()) >= 3


def test_health_is_the_same_but_for_the_time(native: Run, boards: Run) -> None:
    """State, configuration and its checksum, lost and refused frames, error counters."""

    def health(run: Run) -> Counter[tuple[int, bytes]]:
        told: Counter[tuple[int, bytes]] = Counter()
        for frame in answers(run, HEALTH):
            data = bytearray(frame.data)
            if data[1] == 1:
                data[UPTIME] = bytes(2)
            told[frame.arbitration_id, bytes(data)] += 1
        return told

    assert health(native) == health(boards)


def test_robots_hear_the_cells_of_both(native: Run, boards: Run) -> None:
    for run in (native, boards):
        states = {row["robot"]: row["state"] for row in run.robots().to_pylist()}
        rows = run.robots().to_pylist()
        entered = {row["robot"] for row in rows if row["state"] in ("entering", "resting")}
        assert {0, 2} <= entered, states


@pytest.mark.long
def test_a_hex_is_run_as_it_is(boards: Run, run_grid: RunGrid) -> None:
    """The one that was built for `cpu = "avr"`, under the other key, to the same result."""
    modules = Experiment.load(boards.folder / "experiment.toml").modules
    assert modules is not None
    image = build_group(replace(modules, tier="interpreted")).file
    again = run_grid("--set", "grid.cpu=avr", "--set", f"grid.hex={image}")
    assert result(again) == result(boards)
    resolved = Experiment.load(again.folder / "experiment.toml")
    assert resolved.modules is not None
    assert resolved.modules.program.path.read_bytes() == image.read_bytes()
