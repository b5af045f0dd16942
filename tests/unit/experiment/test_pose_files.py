"""Start poses come from tables of ours, of Kilombo's and of trackers, and from run folders."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from kilotwin.errors import InputError

from ..conftest import Load

SWARM = """duration_s = 1
[arena]
diameter_m = 2
[swarm]
profile = "kilobot"
[[robots]]
program = "blink.c"
poses = "{file}"
{more}
"""
KILOMBO = {
    "bot_positions": [
        {"ID": 1, "direction": 1.5, "x_position": 45.0, "y_position": -10.0},
        {"ID": 0, "direction": 0.0, "x_position": 0.0, "y_position": 0.0},
    ]
}
TWO = [[0.0, 0.0, 0.0], [0.045, -0.01, 1.5]]


@pytest.fixture
def starts(load: Load, tmp_path: Path) -> "Starts":
    return Starts(load, tmp_path)


class Starts:
    """The poses of an experiment with that file."""

    def __init__(self, load: Load, folder: Path) -> None:
        self._load, self._folder = load, folder

    def __call__(self, name: str, text: str | None, more: str = "") -> list[list[float]]:
        if text is not None:
            (self._folder / name).write_text(text)
        (group,) = self._load(SWARM.format(file=name, more=more)).groups
        assert group.poses is not None
        assert group.count == len(group.poses)
        return group.poses


def near(poses: Sequence[Sequence[float]]) -> list[object]:
    return [pytest.approx(pose) for pose in poses]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("ours.csv", "x_m,y_m,heading_rad\n0,0,0\n0.045,-0.01,1.5\n"),
        ("more.csv", "robot;x_m;y_m;heading_rad;led\n1;0;0;0;red\n2;0.045;-0.01;1.5;blue\n"),
        ("tabs.tsv", "heading_rad\tx_m\ty_m\n0\t0\t0\n1.5\t0.045\t-0.01\n"),
        ("bom.csv", "\ufeffx_m, y_m, heading_rad\n0, 0, 0\n0.045, -0.01, 1.5\n"),
        ("kilombo.json", json.dumps(KILOMBO)),
        ("log.json", json.dumps([{"bot_states": []}, {"bot_states": KILOMBO["bot_positions"]}])),
        (
            "list.json",
            json.dumps([dict(zip(("x_m", "y_m", "heading_rad"), p, strict=True)) for p in TWO]),
        ),
    ],
)
def test_a_file_of_a_known_kind_needs_no_word_more(name: str, text: str, starts: Starts) -> None:
    assert starts(name, text) == near(TWO)


def test_a_trackers_columns_are_named_with_their_units(starts: Starts) -> None:
    text = "frame,id,cx,cy,theta\n0,a,110,80,-90\n0,b,100,100,0\n1,a,0,0,0\n"
    more = (
        'columns = { x = "cx", y = "cy", heading = "theta", unit_m = 0.002, angle = "deg", '
        'y_down = true, zero = [100, 100], where = ["frame=0"] }'
    )
    assert starts("track.csv", text, more) == near([[0.02, 0.04, math.pi / 2], [0.0, 0.0, 0.0]])
    one = more.replace('"frame=0"', '"frame = 0", "id=b"')
    assert starts("track.csv", None, one) == near([[0.0, 0.0, 0.0]])


def test_headings_that_a_table_lacks_are_drawn_by_the_seed(starts: Starts) -> None:
    text = "x_m,y_m\n0,0\n0.1,0\n"
    (first, second), again = starts("a.csv", text), starts("a.csv", text)
    assert [first, second] == again
    assert first[:2] == [0, 0]
    assert first[2] != second[2]


def test_a_run_folder_gives_its_last_sample(starts: Starts, tmp_path: Path) -> None:
    rows = {"tick": [0, 0, 61, 61], "x_m": [9.0, 9.0, 0.0, 0.045], "y_m": [9.0, 9.0, 0.0, -0.01]}
    (tmp_path / "run").mkdir()
    table = pa.table({**rows, "heading_rad": [1.0, 1.0, 0.0, 1.5]})
    pq.write_table(table, tmp_path / "run" / "robots.parquet")
    assert starts("run", None) == near(TWO)


def test_the_resolved_experiment_has_the_poses_themselves(load: Load, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(json.dumps(KILOMBO))
    experiment = load(SWARM.format(file="a.json", more=""))
    (tmp_path / "a.json").unlink()
    assert load(experiment.to_toml()).groups[0].poses == near(TWO)


@pytest.mark.parametrize(
    ("text", "more", "said"),
    [
        (None, "", "8: 'a.csv' is not there"),
        ("", "", "8: .*a.csv: is empty"),
        ("x_m,y_m\n", "", "8: .*a.csv: holds no robots"),
        ("a,b\n1,2\n", "", "has no columns x_m and y_m; it has a, b: say by columns = "),
        ("x_m,y_m\n1,north\n", "", "row 1: y_m is 'north'; it must be a number"),
        ("x_m,y_m\n1,nan\n", "", "row 1: y_m is 'nan'"),
        ("x_m,y_m\n1\n", "", "row 1: y_m is None"),
        ("x_m,y_m\n1,2\n", 'columns = { x = "x_m", y = "z" }', "has no column 'z'; it has x_m"),
        ("x_m,y_m\n1,2\n", 'columns = { x = "x_m" }', "9: .*lacks 'y'"),
        ("x_m,y_m\n1,2\n", 'columns = { x = "x_m", y = "y_m", where = ["f=0"] }', "column 'f'"),
        (
            "x_m,y_m\n1,2\n",
            'columns = { x = "x_m", y = "y_m", where = ["x_m=3"] }',
            "no row has x_m=3",
        ),
        ("x_m,y_m\n0,0\n", "count = 2", "1 poses for 2 robots"),
        ("x_m,y_m\n9,0\n", "", "does not stand inside the arena"),
        ("x_m,y_m\n1e9,0\n", "", "poses.0.0 is 1000000000"),
    ],
)
def test_a_file_that_cannot_be_taken_is_told_with_its_line(
    text: str | None, more: str, said: str, starts: Starts
) -> None:
    with pytest.raises(InputError, match=said):
        starts("a.csv", text, more)


@pytest.mark.parametrize("text", ["3", "[1]", '{"bot_positions": 3}', "{", "[" * 100_000])
def test_json_of_another_kind_is_told(text: str, starts: Starts) -> None:
    with pytest.raises(InputError, match="8: "):
        starts("a.json", text)


def test_a_folder_without_a_run_is_told(starts: Starts, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="no run folder, or its run has not ended"):
        starts("empty", None)
