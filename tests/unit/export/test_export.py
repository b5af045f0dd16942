"""Other tools' own readers find in an exported run what was recorded."""

import base64
import csv
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.csv as pa_csv
import pytest
from mcap.reader import make_reader

from kilotwin.errors import InputError, RunError
from kilotwin.experiment.colours import led_byte
from kilotwin.runs.reader import Run
from kilotwin.studies.export.csv_tables import write_csv
from kilotwin.studies.export.mcap_file import write_mcap

from ..known_run import ROBOTS, Begin, samples

TICKS = [0, 10, 20]


@pytest.fixture
def run(begin: Begin) -> Run:
    """Three samples of ten robots, a crash and a print."""
    writer = begin()
    for tick in TICKS:
        writer.add(sample(tick))
    writer.add_event({"kind": "crash", "robot": 2, "tick": 10, "where": "loop"})
    writer.add_event({"kind": "print", "robot": 4, "tick": 15, "text": 'said "a, b"'})
    return Run.open(writer.folder)


def sample(tick: int) -> Any:
    """One, in which robot 0 is red and robot 3 is nowhere."""
    one = samples([tick])
    one["led"][0, 0] = led_byte(3, 0, 0)
    one["x_m"][0, 3] = np.nan
    return one


def rows(file: Path) -> list[dict[str, str]]:
    """The rows of a CSV file."""
    with file.open(newline="") as stream:
        return list(csv.DictReader(stream))


def messages(file: Path) -> list[tuple[str, str, float, dict[str, Any]]]:
    """Topic, schema, time in s and content of each."""
    with file.open("rb") as stream:
        return [
            (
                channel.topic,
                "" if schema is None else schema.name,
                one.log_time / 1e9,
                json.loads(one.data),
            )
            for schema, channel, one in make_reader(stream).iter_messages()
        ]


def test_csv_tables_hold_every_row_with_words_as_text(run: Run, tmp_path: Path) -> None:
    said = write_csv(run, tmp_path / "csv")
    assert "30 rows of robots, 3 rows of sites, 2 events" in said
    table = pa_csv.read_csv(tmp_path / "csv" / "robots.csv")
    truth = run.robots()
    for name in ("tick", "robot", "led"):
        assert table[name].to_pylist() == truth[name].to_pylist()
    np.testing.assert_array_equal(np.float32(table["y_m"].to_pylist()), np.asarray(truth["y_m"]))
    assert table["state"].to_pylist() == truth["state"].to_pylist()
    units = {
        (row["table"], row["column"]): row["unit"] for row in rows(tmp_path / "csv/columns.csv")
    }
    assert units["robots.csv", "x_m"] == "m"
    crash, said_by = rows(tmp_path / "csv/events.csv")
    assert (crash["kind"], json.loads(crash["more"])["where"]) == ("crash", "loop")
    assert (said_by["robot"], said_by["text"]) == ("4", 'said "a, b"')


def test_a_folder_that_is_used_is_left_alone(run: Run, tmp_path: Path) -> None:
    (tmp_path / "used").mkdir()
    (tmp_path / "used" / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match="is there and not empty; name a new folder"):
        write_csv(run, tmp_path / "used")
    assert [file.name for file in (tmp_path / "used").iterdir()] == ["mine.txt"]


def test_mcap_has_robots_at_their_times_and_places_in_their_colours(
    run: Run, tmp_path: Path
) -> None:
    write_mcap(run, tmp_path / "run.mcap")
    found = messages(tmp_path / "run.mcap")
    clouds = [one for one in found if one[0] == "/robots"]
    assert {one[1] for one in clouds} == {"foxglove.PointCloud"}
    np.testing.assert_allclose([one[2] for one in clouds], np.array(TICKS) * 0.032768, atol=1e-8)
    for tick, (_, _, _, cloud) in zip(TICKS, clouds, strict=True):
        assert [field["name"] for field in cloud["fields"]][:4] == ["x", "y", "z", "red"]
        data = base64.b64decode(cloud["data"])
        points = np.frombuffer(data, np.float32).reshape(-1, cloud["point_stride"] // 4)
        known = np.delete(np.arange(ROBOTS), 3)
        np.testing.assert_array_equal(points[:, 0], sample(tick)["x_m"][0, known])
        np.testing.assert_array_equal(points[:, 1], sample(tick)["y_m"][0, known])
        assert tuple(data[12:16]) == (255, 0, 0, 255)
    poses = [one[3]["poses"] for one in found if one[0] == "/poses"]
    turn = poses[0][0]["orientation"]
    heading = 2 * np.arctan2(turn["z"], turn["w"])
    away = (heading - sample(0)["heading_rad"][0, 0] + np.pi) % (2 * np.pi) - np.pi
    assert abs(away) < 1e-3


def test_mcap_has_counts_events_and_the_table(run: Run, tmp_path: Path) -> None:
    write_mcap(run, tmp_path / "run.mcap")
    found = messages(tmp_path / "run.mcap")
    counts = [one[3] for one in found if one[0] == "/counts"]
    assert [one["not_resting"] for one in counts] == run.sites()["not_resting"].to_pylist()
    told = [(one[2], one[3]["level"], one[3]["name"]) for one in found if one[0] == "/events"]
    assert told == [(0.328, 4, "robot 3"), (0.492, 2, "robot 5")]
    ((entity,),) = [one[3]["entities"] for one in found if one[0] == "/table"]
    assert len(entity["lines"]) == 3
    xs = [point["x"] for point in entity["lines"][0]["points"]]
    assert (min(xs), max(xs)) == (-2, 2)


def test_a_run_without_places_is_refused(begin: Begin, tmp_path: Path) -> None:
    writer = begin("placeless", 'record.columns=["led"]')
    writer.add(samples(TICKS))
    with pytest.raises(InputError, match="left out x_m, which is needed here"):
        write_mcap(Run.open(writer.folder), tmp_path / "file")


def test_without_a_library_it_says_what_to_install(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mcap", None)
    with pytest.raises(RunError, match=r"type: pip install 'kilotwin\[mcap\]'"):
        write_mcap(run, run.folder / "file")
