"""Reads a run folder, whole or as a killed run left it."""

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from kilotwin.errors import InputError, cause_of
from kilotwin.experiment.checks.experiment import swarm_size
from kilotwin.experiment.pictures import Picture, floor_picture
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.text import ExperimentText
from kilotwin.runs.columns import (
    CELLS_SCHEMA,
    FRAMES_SCHEMA,
    MODULES_SCHEMA,
    SENT_SCHEMA,
    TRACKING_SCHEMA,
    Records,
)
from kilotwin.runs.folder import (
    CELLS,
    EVENTS,
    EXPERIMENT,
    FINISHED,
    FRAMES,
    MANIFEST,
    MODULES,
    OBJECTS,
    SENT,
    TRACKING,
    UIDS,
)
from kilotwin.runs.not_a_run import not_a_run


def read_parquet(path: Path) -> pa.Table:
    """The whole file, by this thread alone; pa.ArrowException or OSError of a damaged one.

    Threads of Arrow's that were still at it aborted the program where a refusal ended it at once.
    """
    try:
        with pq.ParquetFile(pa.BufferReader(path.read_bytes()), pre_buffer=False) as file:
            return file.read(use_threads=False)
    except UnicodeDecodeError as error:  # in a column's name
        raise pa.ArrowInvalid(str(error)) from None


@dataclass(frozen=True)
class Run:
    """A run folder; tables are read when asked for."""

    folder: Path
    manifest: dict[str, Any]
    experiment: ExperimentSchema

    @staticmethod
    def open(folder: Path) -> "Run":
        """InputError if this is no run folder."""
        try:
            manifest = json.loads((folder / MANIFEST).read_text())
            tables = tomllib.loads((folder / EXPERIMENT).read_text())
            if not isinstance(manifest, dict):
                raise ValueError(f"{MANIFEST} holds no object")
            return Run(folder, manifest, ExperimentSchema.model_validate(tables))
        except (FileNotFoundError, NotADirectoryError):
            raise not_a_run(folder) from None
        except OSError as error:
            reason = cause_of(error)
            raise InputError(
                f"{error.filename}: {reason}; name a run folder that you may read"
            ) from None
        except (ValueError, RecursionError) as error:
            raise _damaged(folder, str(error).splitlines()[0]) from None

    def robots(self, *needed: str) -> pa.Table:
        """A row per recorded robot and sample; InputError if a needed column was not recorded."""
        self.need(*needed)
        return self._table("robots", Records.of(self.experiment, {}).robots_schema)

    def need(self, *columns: str) -> None:
        """InputError if one of these columns of `robots` was not recorded."""
        for name in columns:
            if name not in Records.of(self.experiment, {}).robots_schema.names:
                what = f"record.columns left out {name}, which is needed here"
                raise InputError(f"{self.folder}: {what}; add it there and repeat the run")

    def last_robots(self, *needed: str) -> pa.Table:
        """The same of the last sample alone; InputError if there is none."""
        table = self.robots(*needed)
        if table.num_rows == 0:
            raise InputError(f"{self.folder}: {self._why_no_rows()}")
        return table.filter(pc.equal(table["tick"], table["tick"][-1]))

    def _why_no_rows(self) -> str:
        robots = self.experiment.record.robots_of(self.robots_number)
        if robots is not None and not len(robots):
            return "[record] chose no robots; let it choose some and repeat the run"
        return "no sample was recorded; let the run go on for longer"

    def sites(self) -> pa.Table:
        """A row per sample."""
        return self._table("sites", Records.of(self.experiment, {}).sites_schema)

    def objects(self) -> pa.Table:
        """A row per object and sample; none without objects."""
        return self._table(OBJECTS, Records.of(self.experiment, {}).objects_schema)

    def tracking(self) -> pa.Table:
        """A row per report that the host of a grid fetched; none without a grid."""
        return self._table(TRACKING, TRACKING_SCHEMA)

    def modules(self) -> pa.Table:
        """A row per module of an emulated grid and sample; none unless that was recorded."""
        return self._table(MODULES, MODULES_SCHEMA)

    def frames(self) -> pa.Table:
        """A row per frame and receiver, of a run that recorded them."""
        return self._table(FRAMES, FRAMES_SCHEMA)

    def cells(self) -> pa.Table:
        """A row for each change of what a cell of a lab's own module program shows."""
        return self._table(CELLS, CELLS_SCHEMA)

    def sent(self) -> pa.Table:
        """A row per word that an environment told a robot; none without an environment."""
        return self._table(SENT, SENT_SCHEMA)

    @property
    def robots_number(self) -> int:
        """How many robots the experiment has."""
        return swarm_size(self.experiment)

    def uid_of(self, robot: int) -> int:
        """The uid with which the robot with that index began."""
        uids = self.manifest.get(UIDS)
        return robot + 1 if uids is None else int(uids[robot])

    @property
    def origin(self) -> ExperimentText:
        """The experiment's text, from which files that it names are found; InputError if torn."""
        return ExperimentText.read(self.folder / EXPERIMENT, [])

    def floor(self) -> Picture | None:
        """Sites that are drawn; None, if there are none or the picture is there no more."""
        try:
            return floor_picture(self.experiment, self.origin)
        except InputError:
            return None

    def events(self) -> list[dict[str, Any]]:
        """Events of robots; a line cut short by a kill is left out. InputError if damaged."""
        file = self.folder / EVENTS
        lines = file.read_bytes().splitlines(keepends=True) if file.exists() else []
        try:
            return [_event(line) for line in lines if line.endswith(b"\n")]
        except (ValueError, RecursionError) as error:
            raise _damaged(self.folder, f"{EVENTS}: {str(error).splitlines()[0]}") from None

    def _table(self, name: str, schema: pa.Schema) -> pa.Table:
        table = self._read(name, schema)
        other = [wanted for wanted in schema if not _has(table.schema, wanted)]
        if other:
            made_by = self.manifest.get("kilotwin", "another program")
            what = f"column {other[0].name} is missing, or not {other[0].type}"
            raise InputError(
                f"{self.folder}/{name}.arrows: {what}; kilotwin {made_by} made this run, repeat it"
            )
        return table

    def _read(self, name: str, schema: pa.Schema) -> pa.Table:
        batches = []
        try:
            with (
                pa.OSFile(str(self.folder / f"{name}.arrows")) as file,
                pa.ipc.open_stream(file) as reader,
            ):
                schema = reader.schema
                for batch in reader:
                    batches.append(batch)
        except (pa.ArrowException, OSError) as error:
            # A writer killed early leaves no file, or half a schema; one killed later, half a
            # batch. After a clean end it is damage, and the same is there as Parquet.
            if self.manifest.get("status") == FINISHED:
                return self._parquet(f"{name}.parquet", str(error).splitlines()[0])
        return pa.Table.from_batches(batches, schema)

    def _parquet(self, name: str, why: str) -> pa.Table:
        try:
            return read_parquet(self.folder / name)
        except (pa.ArrowException, OSError):
            raise _damaged(self.folder, why) from None


def _event(line: bytes) -> dict[str, Any]:
    event = json.loads(line)
    if not isinstance(event, dict):
        raise ValueError("a line that is no event")
    return event


def _has(schema: pa.Schema, wanted: pa.Field) -> bool:
    place = schema.get_field_index(wanted.name)  # -1 also if it is there twice
    return place >= 0 and bool(schema.field(place).type == wanted.type)


def _damaged(folder: Path, why: str) -> InputError:
    return InputError(f"{folder}: a damaged run folder ({why}); repeat the run")
