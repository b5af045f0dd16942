"""The folder of a sweep.

sweep.json         name, versions; which engine and programs made it
sweep.toml         the sweep's file
parts/KEY.arrows   one finished trial: its table `sites`, its result in the schema's metadata
failed/KEY/        the run folder of a trial that failed twice
log.jsonl          a line per trial: when, where, how long; and why not
trials.parquet     a row per trial, in the order of the sweep's file
series.parquet     the tables `sites` of all trials, one after the other

A part appears whole or not at all, and the two tables are made from the parts alone: however often
a sweep was stopped and whoever ran its trials, they are the same, bit for bit.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from kilotwin import __version__
from kilotwin.errors import InputError
from kilotwin.experiment_schema import Reading
from kilotwin.sweep.measure import RESULT, Failed, Measured
from kilotwin.sweep.plan import Plan, Trial

ABOUT = "sweep.json"
TRIALS = "trials.parquet"
SERIES = "series.parquet"
_ROW_GROUP = 500_000


def trial_key(trial: Trial, guest_keys: Sequence[str]) -> str:
    """What a trial is recognised by: the resolved experiment and the built programs."""
    parts = [trial.experiment.identity(), *guest_keys]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]


@dataclass(frozen=True)
class DataSet:
    """A sweep's folder."""

    folder: Path

    @staticmethod
    def make(folder: Path, plan: Plan, engine_sha256: str) -> "DataSet":
        """Makes the folder, or goes on in one that the same engine made."""
        about = folder / ABOUT
        if about.is_file():
            made_by = json.loads(about.read_text())["engine_sha256"]
            if made_by != engine_sha256:
                raise InputError(
                    f"--out {folder}: another engine made the trials in it, and one data set has "
                    "one engine; name a new folder, or remove this one"
                )
        elif folder.exists() and any(folder.iterdir()):
            raise InputError(f"--out {folder}: the folder is not empty; name a new one")
        try:
            (folder / "parts").mkdir(parents=True, exist_ok=True)
            tables = {"name": plan.keys.name, "kilotwin": __version__}
            _replace(about, json.dumps({**tables, "engine_sha256": engine_sha256}, indent=2))
            _replace(folder / "sweep.toml", plan.text)
        except OSError as error:
            raise InputError(f"--out {folder}: {error.strerror}; name another folder") from None
        return DataSet(folder)

    def part(self, key: str) -> Path:
        """Where a trial's result is, or will be."""
        return self.folder / "parts" / f"{key}.arrows"

    def failed_folder(self, key: str) -> Path:
        """Where the run folder of a failed trial goes."""
        return self.folder / "failed" / key

    def add(self, measured: Measured) -> None:
        """Keeps a trial's result."""
        _replace(self.part(measured.key), measured.part)

    def log(self, **line: Any) -> None:
        """Adds a line to the log."""
        with (self.folder / "log.jsonl").open("a") as file:
            file.write(json.dumps(line) + "\n")

    def seconds_per_robot_second(self) -> float | None:
        """CPU time that a robot-second took in the trials so far; None without any."""
        file = self.folder / "log.jsonl"
        lines = (
            [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
        )
        done = [line for line in lines if "cpu_s" in line]
        robot_s = sum(line["robot_s"] for line in done)
        return sum(line["cpu_s"] for line in done) / robot_s if robot_s else None

    def assemble(self, plan: Plan, keys: Sequence[str]) -> int:
        """Writes the two tables from the finished ones of these trials; returns how many."""
        finished = [
            (trial, key)
            for trial, key in zip(plan.trials, keys, strict=True)
            if self.part(key).is_file()
        ]
        if not finished:
            return 0
        schemas = {key: _schema(self.part(key)) for _, key in finished}
        rows = [_row(trial, key, plan.varied, schemas[key]) for trial, key in finished]
        _write_rows(self.folder / TRIALS, rows, plan)
        self._write_series([(trial.index, key) for trial, key in finished], list(schemas.values()))
        return len(finished)

    def _write_series(self, parts: Sequence[tuple[int, str]], schemas: list[pa.Schema]) -> None:
        bare = [schema.remove_metadata() for schema in schemas]
        whole = pa.unify_schemas([pa.schema([("trial", pa.uint32())]), *dict.fromkeys(bare)])
        target = self.folder / SERIES
        draft = target.with_name(f".{SERIES}.new")
        with pq.ParquetWriter(draft, whole, compression="zstd") as writer:
            waiting: list[pa.Table] = []
            for index, key in parts:
                waiting.append(_part_rows(index, self.part(key), whole))
                if sum(table.num_rows for table in waiting) >= _ROW_GROUP:
                    writer.write_table(pa.concat_tables(waiting))
                    waiting = []
            if waiting:
                writer.write_table(pa.concat_tables(waiting))
        draft.replace(target)


def _schema(part: Path) -> pa.Schema:
    with pa.OSFile(str(part)) as file, pa.ipc.open_stream(file) as reader:
        return reader.schema


def _part_rows(index: int, part: Path, whole: pa.Schema) -> pa.Table:
    """A part's rows with the trial's index and all columns of the data set; null if not its own."""
    with pa.OSFile(str(part)) as file, pa.ipc.open_stream(file) as reader:
        table = reader.read_all()
    rows = table.num_rows
    columns = [pa.array([index] * rows, pa.uint32())]
    own = set(table.column_names)
    columns += [
        table[field.name] if field.name in own else pa.nulls(rows, field.type)
        for field in list(whole)[1:]
    ]
    return pa.table(columns, schema=whole)


def _row(trial: Trial, key: str, varied: Sequence[str], schema: pa.Schema) -> dict[str, Any]:
    result: Mapping[str, Any] = json.loads(schema.metadata[RESULT])
    experiment = trial.experiment.keys
    row: dict[str, Any] = {"trial": trial.index, "key": key, "base": trial.base, "seed": trial.seed}
    row |= {name: trial.settings.get(name) for name in varied}
    row["robots"] = result["robots"]
    for site, count in result["resting"].items():
        row[f"resting_{site}"] = count
    row["not_resting"] = result["not_resting"]
    row["rule"] = trial.base if experiment.controller is None else experiment.controller.rule
    row["reading"] = _reading_name(experiment.reading)
    row["informed"] = experiment.swarm.informed
    for site in result["resting"]:
        informed = experiment.swarm.informed > 0
        row[f"share_{site}"] = experiment.swarm.informed_for.get(site, 0.0) if informed else 0.0
    row["result_hash"] = result["result_hash"]
    return row


def _reading_name(reading: Reading) -> str:
    """The keys that are not at their defaults: `signal_from crossing, obstacle_m 0.02`."""
    other = [
        f"{key} {json.dumps(value) if isinstance(value, bool) else value}"
        for key, value in reading
        if value != type(reading).model_fields[key].default
    ]
    return ", ".join(other) or "reading A"


def _write_rows(target: Path, rows: Sequence[Mapping[str, Any]], plan: Plan) -> None:
    names = list(dict.fromkeys(name for row in rows for name in row))
    # What varies may be text, numbers or lists; a column has one type, so the rest becomes text.
    columns = {name: _column([row.get(name) for row in rows]) for name in names}
    about = {"sweep": plan.keys.name, "kilotwin": __version__}
    draft = target.with_name(f".{target.name}.new")
    pq.write_table(pa.table(columns).replace_schema_metadata(about), draft, compression="zstd")
    draft.replace(target)


def _column(values: Sequence[Any]) -> pa.Array:
    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        return pa.array([None if value is None else float(value) for value in values])
    if len(kinds) > 1 or kinds & {dict, list}:
        return pa.array([None if value is None else json.dumps(value) for value in values])
    return pa.array(values)


def _replace(target: Path, content: str | bytes) -> None:
    draft = target.with_name(f".{target.name}.new")
    draft.write_bytes(content.encode() if isinstance(content, str) else content)
    draft.replace(target)


def failure_line(failed: Failed) -> dict[str, Any]:
    """How a failure stands in the log and in --json."""
    folder = None if failed.folder is None else str(failed.folder)
    return {"key": failed.key, "failed": failed.reason, "run_folder": folder}
