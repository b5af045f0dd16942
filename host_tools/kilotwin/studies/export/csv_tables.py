"""A run folder as CSV: a file per table, and one that says what their columns are.

A table is copied batch by batch, so that a large one takes no more memory than a small one. Words
are text, bytes hexadecimal, what is null empty.
"""

import csv
import json
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv as pa_csv

from kilotwin.errors import InputError, cause_of
from kilotwin.files.drafts import folder_draft_of
from kilotwin.runs.folder import CELLS, FRAMES, MODULES, OBJECTS, SENT, TRACKING
from kilotwin.runs.reader import Run
from kilotwin.runs.stream_index import StreamIndex
from kilotwin.units import counted

_TABLES = ("robots", "sites", OBJECTS, MODULES, CELLS, FRAMES, TRACKING, SENT)
_COLUMNS = "columns.csv"
_EVENT = ("time_s", "kind", "robot", "text")


def write_csv(run: Run, target: Path) -> str:
    """Fills a new folder; returns a line that says what is in it.

    InputError: a folder that is not empty or cannot be written, a damaged table.
    """
    try:
        if target.exists() and (not target.is_dir() or any(target.iterdir())):
            raise InputError(f"--csv {target}: is there and not empty; name a new folder")
        with folder_draft_of(target) as draft:
            draft.chmod(0o755)
            said = _write(run, draft)
        if not (target / _COLUMNS).exists():
            raise InputError(f"--csv {target}: was made by another meanwhile; name a new folder")
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"--csv {target}: cannot be written ({reason}); name another") from None
    return f"{target}: {said}"


def _write(run: Run, folder: Path) -> str:
    said = []
    columns: list[tuple[str, str, str, str]] = []
    for name in _TABLES:
        file = run.folder / f"{name}.arrows"
        if file.exists():
            index = StreamIndex(file)
            index.refresh()
            if index.batches:
                fields = _copy(run, index, folder / f"{name}.csv")
                columns += [(f"{name}.csv", *field) for field in fields]
                said.append(f"{counted(index.rows, 'row')} of {name}")
    events = run.events()
    _write_events(events, folder / "events.csv")
    with (folder / _COLUMNS).open("w", newline="") as stream:
        csv.writer(stream).writerows([("table", "column", "type", "unit"), *columns])
    return ", ".join([*said, counted(len(events), "event")])


def _copy(run: Run, index: StreamIndex, target: Path) -> list[tuple[str, str, str]]:
    """Name, type and unit of each column."""
    writer: pa_csv.CSVWriter | None = None
    try:
        for batch in index.batches:
            rows = index.read(batch, index.names)
            columns = [_plain(column) for column in rows.columns]
            plain = pa.record_batch(columns, names=index.names)
            writer = writer or pa_csv.CSVWriter(target, plain.schema)
            writer.write_batch(plain)
    except pa.ArrowException as error:
        cause = str(error).splitlines()[0]
        raise InputError(
            f"{run.folder}: {target.stem}.arrows is damaged ({cause}); type: "
            f"kilotwin check-run {run.folder}"
        ) from None
    finally:
        if writer is not None:
            writer.close()
    return [
        (field.name, str(kind), (field.metadata or {}).get(b"unit", b"").decode())
        for field, kind in zip(rows.schema, plain.schema.types, strict=True)
    ]


def _plain(column: pa.Array) -> pa.Array:
    if isinstance(column, pa.DictionaryArray):
        return column.dictionary_decode()
    if pa.types.is_fixed_size_binary(column.type) or pa.types.is_binary(column.type):
        return pa.array([None if one is None else one.hex() for one in column.to_pylist()])
    return column


def _write_events(events: list[dict[str, Any]], target: Path) -> None:
    """Rows of events: fields beside time, kind, robot and text stand in one column, as JSON."""
    with target.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow([*_EVENT, "more"])
        for event in events:
            more = {name: value for name, value in event.items() if name not in _EVENT}
            known = [event.get(name, "") for name in _EVENT]
            writer.writerow([*known, json.dumps(more) if more else ""])
