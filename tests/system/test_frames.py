"""Frames that robots received, recorded and shown: `record.also = ["frames"]`."""

import json
from pathlib import Path

import pytest

from kilotwin.runs.reader import Run
from kilotwin.view.served_run import ServedRun

from .conftest import Kilotwin
from .test_why import THREE

FRAMES = ("--set", 'record.also=["frames"]')


@pytest.fixture(scope="module")
def recorded(kilotwin: Kilotwin, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("frames")
    (folder / "tell.toml").write_text(THREE)
    kilotwin("run", folder / "tell.toml", "--out", folder / "run", "-q", *FRAMES)
    return folder / "run"


def test_each_frame_that_was_received_has_a_row(recorded: Path) -> None:
    run = Run.open(recorded)
    rows = run.frames().to_pylist()
    assert len(rows) == run.manifest["summary"]["stats"]["frames_received"]
    assert {(row["sender"], row["receiver"]) for row in rows} == {(0, 1), (1, 0), (1, 2), (2, 1)}
    first = rows[0]
    assert (first["sender_kind"], first["receiver_kind"], first["type"]) == ("robot", "robot", 0)
    assert first["data"][0] == first["sender"] + 1
    assert all(0.004 < row["end_s"] - row["begin_s"] < 0.005 for row in rows)


def test_recording_them_changes_no_result(
    recorded: Path, kilotwin: Kilotwin, tmp_path: Path
) -> None:
    (tmp_path / "tell.toml").write_text(THREE)
    done = kilotwin("run", tmp_path / "tell.toml", "--out", tmp_path / "run", "--json")
    with_them = Run.open(recorded).manifest["summary"]["result_hash"]
    assert json.loads(done.stdout)["result_hash"] == with_them
    without = Run.open(tmp_path / "run")
    assert not (without.folder / "frames.arrows").exists()
    assert ServedRun(without).frames(0, 5) == []


def test_no_more_are_kept_than_there_is_room_for(kilotwin: Kilotwin, tmp_path: Path) -> None:
    (tmp_path / "tell.toml").write_text(THREE)
    few = (*FRAMES, "--set", "record.frames=7", "--set", "record.sample_s=0.5")
    kilotwin("run", tmp_path / "tell.toml", "--out", tmp_path / "run", "-q", *few)
    assert Run.open(tmp_path / "run").frames().num_rows == 7


def test_the_page_gets_those_between_two_times(recorded: Path) -> None:
    served = ServedRun(Run.open(recorded))
    rows = Run.open(recorded).frames().to_pylist()
    wanted = [row for row in rows if 1 <= row["begin_s"] < 2]
    found = served.frames(1, 2)
    assert [(one["begin_s"], one["from"], one["to"]) for one in found] == [
        (row["begin_s"], row["sender"], row["receiver"]) for row in wanted
    ]
    assert served.scene()["also"] == ["frames"]


def test_the_page_gets_the_chain_that_was_told_last(recorded: Path, kilotwin: Kilotwin) -> None:
    assert ServedRun(Run.open(recorded)).scene()["why"] is None
    kilotwin("why", recorded, "--robot", "3", "--at", "4", "-q")
    lines = ServedRun(Run.open(recorded)).scene()["why"]["lines"]
    assert [(one["from"], one["to"]) for one in lines] == [(1, 2), (0, 1)]
    assert all(one["begin_s"] < one["at_s"] < 4 for one in lines)


@pytest.mark.parametrize("damage", ["", "{", "[]", '{"lines": 3}', '{"lines": [{"from": 1}]}'])
def test_a_damaged_chain_is_not_shown(recorded: Path, damage: str) -> None:
    file = recorded / "why.json"
    before = file.read_text() if file.exists() else None
    file.write_text(damage)
    try:
        assert ServedRun(Run.open(recorded)).scene()["why"] is None
    finally:
        file.unlink()
        if before is not None:
            file.write_text(before)
