"""Start poses from a file: a table of Kilotwin's, Kilombo's or a tracker's, or a run folder."""

import csv
import json
import math
import random
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from pydantic import ValidationError

from kilotwin.errors import InputError, cause_of
from kilotwin.experiment.files import find_file, shown
from kilotwin.experiment.schema.section import MOST_ROBOTS
from kilotwin.experiment.schema.start import PoseColumns
from kilotwin.experiment.text import ExperimentText
from kilotwin.experiment.toml_lines import KeyPath
from kilotwin.experiment.validation_errors import input_error
from kilotwin.files.places import places_of

Row = Mapping[str, Any]

_OURS = PoseColumns(x="x_m", y="y_m", heading="heading_rad")
_KILOMBO = PoseColumns(x="x_position", y="y_position", heading="direction", unit_m=0.001)
_KNOWN = (_OURS, _KILOMBO)
# Lists of robots in Kilombo's files: of start positions, and of a recorded state.
_KILOMBO_LISTS = ("bot_positions", "bot_states")
_RUN_TABLE = "robots.parquet"


def with_poses(kinds: list[Any], origin: ExperimentText) -> dict[str, Any]:
    """The tables of an experiment with these [[robots]]: the poses that files have in place of
    their names, and how many there are where `count` is left out. InputError names file, line and
    column."""
    placed = [_with_poses(kind, ("robots", place), origin) for place, kind in enumerate(kinds)]
    return {**origin.raw, "robots": placed}


def _with_poses(kind: Any, path: KeyPath, origin: ExperimentText) -> Any:
    if not isinstance(kind, dict) or not isinstance(kind.get("poses"), str):
        return kind
    written = kind["poses"]
    columns = _columns(kind.get("columns"), path, origin)
    where = (*path, "poses")
    folder = next((at for at in places_of(written, origin.folder) if at.is_dir()), None)
    file = folder / _RUN_TABLE if folder is not None else find_file(written, where, origin)
    try:
        rows = _selected(list(_rows(file)), columns)
        chance = random.Random(f"headings {path[-1]} {origin.raw.get('seed')}").random
        poses = list(_poses(rows, columns, chance))
    except (OSError, pa.ArrowException) as error:
        reason = cause_of(error) if isinstance(error, OSError) else str(error)
        raise InputError(f"{origin.where(where)}: {shown(file)}: {reason}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{origin.where(where)}: {shown(file)}: {error}") from None
    kept = {key: value for key, value in kind.items() if key != "columns"}
    return {"count": len(poses), **kept, "poses": poses}


def _columns(written: Any, path: KeyPath, origin: ExperimentText) -> PoseColumns | None:
    if written is None:
        return None
    try:
        return PoseColumns.model_validate(written)
    except ValidationError as error:
        raise input_error(origin, error, (*path, "columns")) from None


def _rows(file: Path) -> Iterator[Row]:
    """Rows by column; of a run those of its last sample. ValueError says what is wrong."""
    if file.name == _RUN_TABLE:
        if not file.exists():
            raise ValueError("not there: that is no run folder, or its run has not ended")
        table = pq.read_table(file)
        if not table.num_rows:
            raise ValueError("the run recorded no robots")
        yield from table.filter(pc.equal(table["tick"], table["tick"][-1])).to_pylist()
    elif file.suffix.lower() == ".json":
        yield from _rows_of_json(json.loads(file.read_text(encoding="utf-8-sig")))
    else:
        yield from _rows_of_csv(file.read_text(encoding="utf-8-sig"))


def _rows_of_json(found: Any) -> list[Row]:
    """A list of objects; Kilombo's, or the last of a list of them."""
    last = found[-1] if isinstance(found, list) and found else found
    lists = [last[name] for name in _KILOMBO_LISTS if isinstance(last, dict) and name in last]
    rows = lists[0] if lists else found
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise ValueError('holds no list of robots, such as [{"x_m": 0.1, "y_m": 0, ...}, ...]')
    return sorted(rows, key=lambda row: row.get("ID", 0)) if lists else rows


def _rows_of_csv(text: str) -> Iterator[Row]:
    """By the names in its first line, between commas, semicolons or tabs."""
    lines = text.splitlines()
    if not lines:
        raise ValueError("is empty")
    delimiter = max(",;\t", key=lines[0].count)
    yield from csv.DictReader(lines, delimiter=delimiter, skipinitialspace=True)


def _selected(rows: list[Row], columns: PoseColumns | None) -> list[Row]:
    """Those that meet `where`."""
    for text in [] if columns is None else columns.where:
        column, _, value = text.partition("=")
        _need(rows, column.strip())
        rows = [row for row in rows if _same(row[column.strip()], value.strip())]
        if not rows:
            raise ValueError(f"no row has {text}")
    return rows


def _same(found: Any, wanted: str) -> bool:
    try:
        return float(found) == float(wanted)
    except (TypeError, ValueError):
        return str(found) == wanted


def _need(rows: list[Row], column: str) -> None:
    if rows and column not in rows[0]:
        raise ValueError(f"has no column '{column}'; it has {', '.join(map(str, rows[0]))}")


def _poses(
    rows: list[Row], columns: PoseColumns | None, chance: Callable[[], float]
) -> Iterator[list[float]]:
    if not rows:
        raise ValueError("holds no robots")
    if len(rows) > MOST_ROBOTS:
        raise ValueError(f"{len(rows):,} rows; a swarm has at most {MOST_ROBOTS:,} robots")
    columns = columns or _known(rows[0])
    for column in filter(None, (columns.x, columns.y, columns.heading)):
        _need(rows, column)
    turns = -1 if columns.y_down else 1
    of_angle = turns * (math.pi / 180 if columns.angle == "deg" else 1)
    for place, row in enumerate(rows, 1):
        x = (_number(row, columns.x, place) - columns.zero[0]) * columns.unit_m
        y = (_number(row, columns.y, place) - columns.zero[1]) * columns.unit_m * turns
        if columns.heading is None:
            heading = (2 * chance() - 1) * math.pi
        else:
            heading = math.remainder(_number(row, columns.heading, place) * of_angle, math.tau)
        yield [x, y, heading]


def _known(row: Row) -> PoseColumns:
    for columns in _KNOWN:
        if columns.x in row and columns.y in row:
            has_headings = columns.heading in row
            return columns if has_headings else columns.model_copy(update={"heading": None})
    example = 'columns = { x = "...", y = "...", unit_m = 0.001 }'
    raise ValueError(
        f"has no columns {_OURS.x} and {_OURS.y}; it has {', '.join(map(str, row))}: say by "
        f"{example} which are meant"
    )


def _number(row: Row, column: str, place: int) -> float:
    try:
        number = float(row[column])
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"row {place}: {column} is {row.get(column)!r}; it must be a number")
    return number
