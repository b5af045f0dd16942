"""A run folder is whole, truncated, spoiled or damaged, and mended as far as it can be."""

import json
import os
import shutil
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from .conftest import SIMPLIFIED, Kilotwin


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("checked") / "run"


@pytest.fixture
def run(finished: Path, kilotwin: Kilotwin, tmp_path: Path) -> Path:
    """A finished run, to be spoilt."""
    if not finished.exists():
        kilotwin("run", SIMPLIFIED, "--set", "duration_s=60", "--out", finished, "-q")
    return Path(shutil.copytree(finished, tmp_path / "run"))


def as_killed(run: Path) -> None:
    """As a kill would have left it: half a batch, half a line, no Parquet, an hour ago."""
    manifest = json.loads((run / "manifest.json").read_text())
    for key in ("summary", "exit_code", "ended_utc"):
        manifest.pop(key)
    (run / "manifest.json").write_text(json.dumps({**manifest, "status": "running"}))
    for name in ("robots", "sites"):
        (run / f"{name}.parquet").unlink()
        stream = run / f"{name}.arrows"
        stream.write_bytes(stream.read_bytes()[:-100])
        os.utime(stream, (1e9, 1e9))
    with (run / "events.jsonl").open("a") as events:
        events.write('{"time_s": 1')


def test_a_whole_run_is_said_to_be_whole(kilotwin: Kilotwin, run: Path) -> None:
    done = kilotwin("check-run", run)
    assert done.stdout.startswith(f"{run}: whole\n")
    assert "robots 700" in done.stdout
    assert "engine box2d" in done.stdout


def test_a_killed_run_is_truncated_and_mended(kilotwin: Kilotwin, run: Path) -> None:
    as_killed(run)
    found = json.loads(kilotwin("check-run", run, "--json", expect=1).stdout)
    assert found["state"] == "truncated"
    assert any("it runs still, or was killed" in finding for finding in found["findings"])
    assert 0 < found["rows"]["robots"] < 700
    done = kilotwin("check-run", run, "--repair", expect=1)
    assert "robots.parquet has the" in done.stdout
    assert pq.read_table(run / "robots.parquet").num_rows == found["rows"]["robots"]
    assert json.loads((run / "manifest.json").read_text())["status"] == "failed"
    assert all(map(json.loads, (run / "events.jsonl").read_text().splitlines()))
    again = json.loads(kilotwin("check-run", run, "--json", expect=1).stdout)
    assert not [finding for finding in again["findings"] if "events" in finding]


def test_a_run_that_may_go_on_is_not_mended(kilotwin: Kilotwin, run: Path) -> None:
    as_killed(run)
    os.utime(run / "robots.arrows")
    assert "it may run still" in kilotwin("check-run", run, "--repair", expect=2).stderr


def test_a_spoiled_record_says_so(kilotwin: Kilotwin, run: Path) -> None:
    manifest = json.loads((run / "manifest.json").read_text())
    spoiled = {**manifest, "spoiled": "another host was on the table"}
    (run / "manifest.json").write_text(json.dumps(spoiled))
    assert ": spoiled\n" in kilotwin("check-run", run, expect=1).stdout


def test_damage_after_a_clean_end_is_named(kilotwin: Kilotwin, run: Path) -> None:
    whole = (run / "robots.arrows").read_bytes()
    (run / "robots.arrows").write_bytes(whole[: len(whole) // 2])
    (run / "sites.parquet").unlink()
    done = kilotwin("check-run", run, expect=1)
    assert ": damaged\n" in done.stdout
    assert "robots.arrows is cut off behind" in done.stdout
    assert "sites.parquet is not there" in done.stdout


def test_a_folder_that_is_no_run_is_refused(kilotwin: Kilotwin, tmp_path: Path) -> None:
    assert "not a run folder" in kilotwin("check-run", tmp_path, expect=2).stderr
