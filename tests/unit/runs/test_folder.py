"""A run folder is whole or readable as far as it was written."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.check import check
from kilotwin.runs.folder import check_free, close_manifest, default_folder
from kilotwin.runs.reader import Run, read_parquet
from kilotwin.runs.writer import RunWriter

from ..conftest import SMALL, Load

if TYPE_CHECKING:
    from kilotwin._emulator import Event, Samples

WITH_CONTROLLER = f"{SMALL}\n[controller]\n"
ROBOTS = 10


def some_samples(first: int, k: int) -> "Samples":
    """k samples of ten robots: the first two rest on black, the third on white, the rest walk."""
    led = np.zeros((k, ROBOTS), np.uint8)
    led[:, :3] = 0x3F
    site = np.zeros((k, ROBOTS), np.uint8)
    site[:, :3] = [1, 1, 2]
    x = np.arange(k * ROBOTS, dtype=np.float32).reshape(k, ROBOTS)
    tick = np.arange(first, first + k, dtype=np.int64) * 305
    return {"tick": tick, "x_m": x, "y_m": -x, "heading_rad": x, "led": led, "site": site}


@pytest.fixture
def experiment(load: Load) -> Experiment:
    return load(WITH_CONTROLLER)


def write(folder: Path, experiment: Experiment, batches: int) -> RunWriter:
    writer = RunWriter(folder, experiment, {"status": "running"})
    for batch in range(batches):
        writer.add(some_samples(3 * batch, 3))
    return writer


def test_what_is_written_is_read(experiment: Experiment, tmp_path: Path) -> None:
    writer = write(tmp_path / "run", experiment, 2)
    event: Event = {
        "tick": 305,
        "robot_tick": 306,
        "robot": 3,
        "program": "p",
        "kind": "print",
        "text": "hello",
    }
    writer.add_event(event)
    writer.close(clean=True)
    run = Run.open(tmp_path / "run")
    robots, sites = run.robots(), run.sites()
    assert robots.num_rows == 6 * ROBOTS
    assert robots.slice(0, 4)["state"].to_pylist() == ["resting", "resting", "resting", "walking"]
    assert robots.slice(0, 4)["site"].to_pylist() == ["black", "black", "white", None]
    assert robots["robot"].to_pylist() == list(range(ROBOTS)) * 6
    assert robots["tick"].to_pylist()[::ROBOTS] == [0, 305, 610, 915, 1220, 1525]
    assert robots["time_s"][ROBOTS].as_py() == pytest.approx(9.99424)
    assert sites["resting_black"].to_pylist() == [2] * 6
    assert sites["resting_white"].to_pylist() == [1] * 6
    assert sites["not_resting"].to_pylist() == [7] * 6
    assert sites["state_walking"].to_pylist() == [7] * 6
    assert run.events() == [{"time_s": 9.994, **event}]


def test_every_column_has_a_unit_and_the_file_says_what_it_is(
    experiment: Experiment, tmp_path: Path
) -> None:
    write(tmp_path / "run", experiment, 1).close(clean=False)
    schema = Run.open(tmp_path / "run").robots().schema
    assert schema.field("x_m").metadata == {b"unit": b"m"}
    assert all(field.metadata[b"unit"] for field in schema)
    kept = (tmp_path / "run/experiment.toml").read_text()
    assert schema.metadata[b"experiment"].decode() == kept


def test_a_clean_end_leaves_the_same_as_parquet(experiment: Experiment, tmp_path: Path) -> None:
    write(tmp_path / "run", experiment, 3).close(clean=True)
    run = Run.open(tmp_path / "run")
    assert pq.read_table(tmp_path / "run/robots.parquet").equals(run.robots())
    assert pq.read_table(tmp_path / "run/sites.parquet").equals(run.sites())
    names = {path.name for path in (tmp_path / "run").iterdir()}
    assert names == {
        "manifest.json",
        "experiment.toml",
        "events.jsonl",
        "robots.arrows",
        "sites.arrows",
        "robots.parquet",
        "sites.parquet",
        "parcel",
    }


def test_an_early_end_leaves_no_parquet(experiment: Experiment, tmp_path: Path) -> None:
    write(tmp_path / "run", experiment, 3).close(clean=False)
    assert not list((tmp_path / "run").glob("*.parquet"))


def test_the_experiment_in_the_folder_repeats_the_run(
    experiment: Experiment, tmp_path: Path
) -> None:
    write(tmp_path / "run", experiment, 0).close(clean=True)
    again = Experiment.load(tmp_path / "run/experiment.toml").resolved()
    wanted = experiment.resolved()
    assert again["swarm"].pop("program") == str(tmp_path / "run/parcel/blink.c")
    assert wanted["swarm"].pop("program") == str(tmp_path / "blink.c")
    assert again == wanted


def test_a_stream_cut_anywhere_in_its_last_batch_gives_the_batches_before(
    experiment: Experiment, tmp_path: Path
) -> None:
    writer = write(tmp_path / "run", experiment, 2)
    stream = tmp_path / "run/robots.arrows"
    two_batches = stream.stat().st_size
    writer.add(some_samples(6, 3))
    whole = stream.read_bytes()
    writer.close(clean=False)
    run = Run.open(tmp_path / "run")
    expected = run.robots().slice(0, 6 * ROBOTS)
    for length in range(two_batches, len(whole)):
        stream.write_bytes(whole[:length])
        assert run.robots().equals(expected), f"cut after {length} of {len(whole)} bytes"


def test_a_stream_cut_anywhere_before_its_first_batch_is_empty(
    experiment: Experiment, tmp_path: Path
) -> None:
    writer = write(tmp_path / "run", experiment, 0)
    stream = tmp_path / "run/sites.arrows"
    whole = stream.read_bytes()
    writer.close(clean=False)
    run = Run.open(tmp_path / "run")
    for length in range(len(whole)):
        stream.write_bytes(whole[:length])
        table = run.sites()
        assert table.num_rows == 0
        assert table.column_names[-1] == "state_avoiding"
    stream.unlink()
    assert run.sites().num_rows == 0


def test_an_event_cut_short_is_left_out(experiment: Experiment, tmp_path: Path) -> None:
    writer = write(tmp_path / "run", experiment, 0)
    for tick in (1, 2):
        event: Event = {
            "tick": tick,
            "robot_tick": tick,
            "robot": 0,
            "program": "p",
            "kind": "print",
            "text": "x",
        }
        writer.add_event(event)
    writer.close(clean=False)
    file = tmp_path / "run/events.jsonl"
    file.write_bytes(file.read_bytes()[:-5])
    assert [event["tick"] for event in Run.open(tmp_path / "run").events()] == [1]


WRITER = """
import os, sys
from pathlib import Path
from kilotwin import _emulator
from kilotwin.experiment.experiment import Experiment
from tests.unit.runs.test_folder import some_samples, RunWriter
_emulator.end_with_parent(os.getppid())  # it would fill the disk
experiment = Experiment.load(Path(sys.argv[1]))
writer = RunWriter(Path(sys.argv[2]), experiment, {"status": "running"})
batch = 0
while True:
    writer.add(some_samples(3 * batch, 3))
    batch += 1
"""


@pytest.mark.parametrize("moment_s", [0.0, 0.05, 0.11, 0.23])
def test_a_writer_killed_at_any_moment_leaves_what_it_wrote(
    moment_s: float, experiment: Experiment, tmp_path: Path
) -> None:
    target = tmp_path / "run"
    root = Path(__file__).parents[3]
    with subprocess.Popen(
        [sys.executable, "-c", WRITER, str(experiment.origin.source), str(target)],
        env={**os.environ, "PYTHONPATH": str(root)},
    ) as writer:
        end = time.monotonic() + 600
        while not target.exists():
            assert writer.poll() is None
            assert time.monotonic() < end
        time.sleep(moment_s)  # the moment is what this test is about
        writer.send_signal(signal.SIGKILL)
    run = Run.open(target)
    robots, sites = run.robots(), run.sites()
    assert robots.num_rows % (3 * ROBOTS) == 0
    assert robots.num_rows // ROBOTS - sites.num_rows in (0, 3)
    assert run.manifest["status"] == "running"
    close_manifest(target, "failed", 1, reason="killed")
    closed = Run.open(target).manifest
    assert (closed["status"], closed["exit_code"], closed["reason"]) == ("failed", 1, "killed")


def test_an_empty_folder_may_be_used(experiment: Experiment, tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    check_free(tmp_path / "run")
    write(tmp_path / "run", experiment, 1).close(clean=True)
    assert Run.open(tmp_path / "run").robots().num_rows == 3 * ROBOTS


def test_a_folder_in_use_is_never_written_over(experiment: Experiment, tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run/mine.txt").write_text("mine")
    with pytest.raises(InputError, match="not empty"):
        check_free(tmp_path / "run")
    with pytest.raises(OSError, match="not empty"):
        write(tmp_path / "run", experiment, 0)
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["mine.txt"]
    assert not list(tmp_path.glob(".run*"))


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file"):
        check_free(tmp_path / "file" / "run")
    with pytest.raises(InputError, match="cannot write in /proc"):
        check_free(Path("/proc/run"))


def test_checking_leaves_nothing_behind(tmp_path: Path) -> None:
    check_free(tmp_path / "deep" / "run")
    assert list(tmp_path.iterdir()) == []


def test_the_default_folder_names_experiment_and_seed(
    load: Load, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    experiment = load(SMALL, "name=simplified, N = 100", "seed=7")
    folder = default_folder(experiment)
    assert folder.parent == Path("runs")
    assert folder.name.startswith("simplified-n-100-seed7-2")


def test_what_is_no_run_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"not a run folder \(no manifest.json\)"):
        Run.open(tmp_path)
    with pytest.raises(InputError, match=r"no such run folder"):
        Run.open(tmp_path / "nowhere")
    (tmp_path / "manifest.json").write_text("{")
    (tmp_path / "experiment.toml").write_text("")
    with pytest.raises(InputError, match="damaged"):
        Run.open(tmp_path)


@pytest.mark.parametrize("line", [b"\xff\n", b"{\n", b"[]\n", b"[" * 100_000 + b"\n"])
def test_damaged_events_are_named(line: bytes, experiment: Experiment, tmp_path: Path) -> None:
    write(tmp_path / "run", experiment, 0).close(clean=False)
    with (tmp_path / "run/events.jsonl").open("ab") as file:
        file.write(line)
    with pytest.raises(InputError, match=r"a damaged run folder \(events.jsonl: "):
        Run.open(tmp_path / "run").events()


def test_a_manifest_nested_too_deep_is_damaged(experiment: Experiment, tmp_path: Path) -> None:
    write(tmp_path / "run", experiment, 0).close(clean=False)
    (tmp_path / "run/manifest.json").write_text("[" * 100_000)
    with pytest.raises(InputError, match="a damaged run folder"):
        Run.open(tmp_path / "run")


def test_what_is_missing_of_a_run_folder_is_named(experiment: Experiment, tmp_path: Path) -> None:
    write(tmp_path / "run", experiment, 0).close(clean=False)
    (tmp_path / "run/experiment.toml").unlink()
    with pytest.raises(InputError, match=r"not a run folder \(no experiment.toml\)"):
        Run.open(tmp_path / "run")


@pytest.mark.parametrize("damage", [lambda _: None, lambda whole: whole[:-100]])
def test_a_stream_damaged_after_a_clean_end_is_read_from_parquet_or_refused(
    damage: Callable[[bytes], bytes | None], experiment: Experiment, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    write(folder, experiment, 3).close(clean=True)
    close_manifest(folder, "finished", 0)
    stream = folder / "robots.arrows"
    whole = Run.open(folder).robots()
    left = damage(stream.read_bytes())
    stream.unlink()
    if left is not None:
        stream.write_bytes(left)
    assert Run.open(folder).robots().equals(whole)
    (folder / "robots.parquet").unlink()
    with pytest.raises(InputError, match=r"a damaged run folder \(.*\); repeat the run"):
        Run.open(folder).robots()


def test_the_manifest_is_replaced_in_one_step(experiment: Experiment, tmp_path: Path) -> None:
    write(tmp_path / "run", experiment, 0).close(clean=False)
    close_manifest(tmp_path / "run", "interrupted", 130)
    manifest = json.loads((tmp_path / "run/manifest.json").read_text())
    assert manifest["status"] == "interrupted"
    assert manifest["ended_utc"].endswith("+00:00")
    assert not list((tmp_path / "run").glob(".*"))


def test_a_log_that_was_cut_or_removed_is_damage(experiment: Experiment, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    writer = write(folder, experiment, 3)
    (folder / "can.log").write_text("(0.1) can0 001#\n" * 3)
    writer.close(clean=True)
    close_manifest(folder, "finished", 0)
    assert check(folder).state == "whole"
    (folder / "map.png").write_bytes(b"made later")
    assert check(folder).state == "whole"
    (folder / "can.log").write_text("(0.1) can0 001#\n" * 2)
    cut = check(folder)
    assert (cut.state, cut.findings[-1]) == ("damaged", "can.log is cut off: 32 of 48 bytes")
    (folder / "can.log").unlink()
    assert check(folder).findings[-1] == "can.log is not there"


def test_streams_are_readable_while_they_are_written(
    experiment: Experiment, tmp_path: Path
) -> None:
    writer = write(tmp_path / "run", experiment, 2)
    assert pa.ipc.open_stream(tmp_path / "run/robots.arrows").schema.names[0] == "tick"
    assert Run.open(tmp_path / "run").robots().num_rows == 6 * ROBOTS
    writer.close(clean=False)


def test_a_column_whose_name_is_no_text_makes_a_table_damaged(tmp_path: Path) -> None:
    file = tmp_path / "x.parquet"
    pq.write_table(pa.table({"column": [1, 2]}), file)
    file.write_bytes(file.read_bytes().replace(b"column", b"\xe3(lumn"))
    with pytest.raises(pa.ArrowInvalid, match="invalid continuation byte"):
        read_parquet(file)
