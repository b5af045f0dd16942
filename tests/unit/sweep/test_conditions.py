"""Which trials of a data set are counted together, and what no sweep of ours has written."""

import json
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from tests.truth.paper import check

from kilotwin.errors import InputError
from kilotwin.studies.plot.figures import write_figure
from kilotwin.studies.sweep.conditions import Conditions

ROW: dict[str, Any] = {
    "trial": 0,
    "key": "k",
    "base": "mine",
    "seed": 1,
    "swarm.informed": 0.2,
    "controller.beta": 1.5,
    "motion.gives_way": None,
    "robots": 50,
    "resting_black": 30,
    "resting_white": 15,
    "not_resting": 5,
    "rule": "simplified",
    "reading": "reading A",
    "informed": 0.2,
    "share_black": 0.5,
    "share_white": 0.5,
    "result_hash": "0",
}


def data_set(folder: Path, *changes: dict[str, Any], without: str = "") -> Path:
    """A folder with a trial for each of the changes to ROW."""
    rows = [ROW | {"seed": seed} | change for seed, change in enumerate(changes, 1)]
    table = pa.Table.from_pylist(rows)
    pq.write_table(table.drop_columns([without]) if without else table, folder / "trials.parquet")
    (folder / "sweep.json").write_text(json.dumps({"name": "mine"}))
    return folder


def count(folder: Path, *where: str) -> list[int]:
    return [len(endings) for endings in Conditions.open(folder, where).endings.values()]


def test_a_sweep_that_lacks_trials_says_how_many_it_has(tmp_path: Path) -> None:
    folder = data_set(tmp_path, {}, {})
    assert Conditions.open(folder).progress == ""  # made by a Kilotwin that did not count them
    told: list[str] = []
    for planned in (2, 3):
        (folder / "sweep.json").write_text(json.dumps({"name": "mine", "trials": planned}))
        check(folder, note=told.append)
    assert told == [f"{folder}: 2 of the sweep's 3 trials"]


def test_trials_that_differ_in_luck_and_in_who_is_informed_are_sorted_by_condition(
    tmp_path: Path,
) -> None:
    more = {"swarm.informed": 0.4, "informed": 0.4}
    assert count(data_set(tmp_path, {}, {}, more)) == [2, 1]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"controller.beta": 2.25}, "differ in controller.beta (1.5 and 2.25)"),
        ({"motion.gives_way": False}, "--where motion.gives_way=none"),
        ({"base": "other"}, "differ in base (mine and other)"),
    ],
)
def test_trials_that_differ_in_anything_else_are_not_counted_together(
    tmp_path: Path, change: dict[str, Any], says: str
) -> None:
    with pytest.raises(InputError, match=re.escape(says)):
        count(data_set(tmp_path, {}, change))


@pytest.mark.parametrize("order", [sorted, reversed])
def test_what_varied_is_found_wherever_its_column_stands(
    tmp_path: Path, order: Callable[[Iterable[str]], Iterable[str]]
) -> None:
    folder = data_set(tmp_path, {}, {"controller.beta": 2.25, "note": "odd"})
    table = pq.read_table(folder / "trials.parquet")
    pq.write_table(table.select(list(order(table.column_names))), folder / "trials.parquet")
    with pytest.raises(InputError, match="differ in controller"):
        count(folder)


def test_columns_that_others_added_are_no_keys(tmp_path: Path) -> None:
    folder = data_set(tmp_path, {}, {}, {})
    table = pq.read_table(folder / "trials.parquet")
    place = table.column_names.index("robots")
    pq.write_table(table.add_column(place, "note", [["a", "b", "c"]]), folder / "trials.parquet")
    assert count(folder) == [3]


def test_where_chooses_trials(tmp_path: Path) -> None:
    folder = data_set(tmp_path, {}, {}, {"controller.beta": 2.25}, {"motion.gives_way": False})
    assert count(folder, "controller.beta=2.25") == [1]
    assert count(folder, "controller.beta=1.5", "motion.gives_way=none") == [2]
    assert count(folder, "motion.gives_way=false") == [1]


def test_where_takes_columns_of_sites_with_odd_names(tmp_path: Path) -> None:
    red = {"resting_red, left": 0, "share_red, left": 0.0}
    folder = data_set(tmp_path, red | {"seed": 1}, red | {"resting_red, left": 3})
    assert count(folder, "resting_red, left=3") == [1]


@pytest.mark.parametrize(
    ("column", "value"),
    [("arena.centre_m", "[0.5, 0.0]"), ("name", "2024"), ("name", "true"), ("name", '"rest"')],
)
def test_where_takes_a_value_as_it_stands_in_the_table(
    tmp_path: Path, column: str, value: str
) -> None:
    folder = data_set(tmp_path, {column: value}, {column: "other"})
    with pytest.raises(InputError, match="differ in") as caught:
        count(folder)
    assert str(caught.value).endswith(f"as by --where {column}={value}")
    assert count(folder, f"{column}={value}") == [1]


@pytest.mark.parametrize(
    ("where", "says"),
    [
        ("controller.beta", "not of the form column=value"),
        ("beta=1.5", "has the columns trial, key, base"),
        ("controller.beta=3", "no trial has it; controller.beta is 1.5"),
    ],
)
def test_where_that_chooses_nothing_is_refused(tmp_path: Path, where: str, says: str) -> None:
    with pytest.raises(InputError, match=re.escape(says)):
        count(data_set(tmp_path, {}), where)


@pytest.mark.parametrize(
    "column", ["base", "rule", "robots", "informed", "not_resting", "share_black", "resting_white"]
)
def test_a_table_without_a_column_is_refused(tmp_path: Path, column: str) -> None:
    with pytest.raises(InputError, match=r"no column|without its resting_ column"):
        count(data_set(tmp_path, {}, without=column))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"informed": float("nan")}, "informed is nan"),
        ({"resting_black": -5}, "resting_black is -5"),
        ({"resting_black": "2"}, "resting_black is '2'"),
        ({"share_black": None}, "share_black is None"),
        ({"robots": 0}, "robots is 0"),
        ({"robots": 50.5}, "robots is 50.5, no number of robots"),
        ({"robots": True}, "robots is True, no number of robots"),
        ({"resting_black": 51}, "resting_black is 51, no number of robots"),
        ({"informed": 1.5}, "informed is 1.5, no share from 0 to 1"),
        ({"rule": None}, "rule is None, no text"),
        ({"rule": ["firat"]}, "rule is ['firat'], no text"),
        ({"base": 3}, "base is 3, no text"),
        ({"reading": None}, "reading is None, no text"),
        ({"resting_black": None}, "resting_black is None"),
        (
            dict.fromkeys(["resting_black", "resting_white", "share_black", "share_white"]),
            "a trial with seed 1 has no site",
        ),
    ],
)
def test_what_is_no_number_of_robots_is_refused(
    tmp_path: Path, change: dict[str, Any], says: str
) -> None:
    with pytest.raises(InputError, match=re.escape(says)):
        count(data_set(tmp_path, change))


def test_whole_numbers_may_be_written_with_a_point(tmp_path: Path) -> None:
    floats = {key: float(ROW[key]) for key in ROW if isinstance(ROW[key], int)}
    folder = data_set(tmp_path, floats | {"informed": 0.0})
    ((condition, (ending,)),) = Conditions.open(folder).endings.items()
    assert (condition.robots, ending.resting, ending.nowhere) == (50, (30, 15), 5)
    write_figure("symmetry", folder, tmp_path / "symmetry.png")


def test_a_number_of_trials_that_is_none_is_damage(tmp_path: Path) -> None:
    folder = data_set(tmp_path, {})
    (folder / "sweep.json").write_text('{"name": "mine", "trials": "9"}')
    with pytest.raises(InputError, match=r"sweep\.json: damaged"):
        Conditions.open(folder)


def test_a_site_of_other_trials_may_be_empty(tmp_path: Path) -> None:
    assert count(data_set(tmp_path, {}, {"resting_white": None, "share_white": None})) == [1, 1]


def test_tables_without_trials_or_sites_or_that_are_damaged_are_refused(tmp_path: Path) -> None:
    file = data_set(tmp_path, {}) / "trials.parquet"
    whole = pq.read_table(file)
    for table, says in [
        (whole.slice(0, 0), "no trial in it"),
        (whole.drop_columns([c for c in ROW if c.startswith(("resting", "share"))]), "no sites"),
    ]:
        pq.write_table(table, file)
        with pytest.raises(InputError, match=says):
            count(tmp_path)
    file.write_bytes(b"PAR1 and no more")
    with pytest.raises(InputError, match="the sweep's own command makes it anew"):
        count(tmp_path)
