"""The folder of a sweep.

sweep.json         name, versions; which engine made it, and how many and which trials it is to have
sweep.toml         the sweep's file
parts              the finished trials, as they came (parts.py): of each its table `sites` as an
                   Arrow stream, with its result in the schema's metadata
failed/KEY/        the run folder of a trial that failed twice, until it succeeds
log.jsonl          a line per trial: when, where, how long; and why not
trials.parquet     a row per trial, in the order of the sweep's file
series.parquet     the tables `sites` of all trials, one after the other

The two tables are made from the parts alone: however often
a sweep was stopped and whoever ran its trials, they are the same, bit for bit.
"""

import contextlib
import errno
import fcntl
import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from kilotwin import __version__
from kilotwin.errors import InputError, RunError, cause_of
from kilotwin.experiment.schema.controller import reading_name
from kilotwin.files.drafts import draft_name, draft_of
from kilotwin.runs.columns import METRIC
from kilotwin.studies.pool.task import Failed
from kilotwin.studies.sweep.measure import RESULT, table_of
from kilotwin.studies.sweep.parts import Parts
from kilotwin.studies.sweep.plan import Plan, Trial

ABOUT = "sweep.json"
TRIALS = "trials.parquet"
SERIES = "series.parquet"
METRICS_FAILED = "metrics_failed"
"""A column of trials.parquet, if a metric failed in one of them: which, where and how."""
_ROW_GROUP = 500_000


def trial_key(trial: Trial, guest_keys: Sequence[str]) -> str:
    """The key of a trial: a hash of the resolved experiment and of the built programs."""
    parts = [trial.experiment.identity(), *guest_keys]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]


def about(folder: Path, key: str, default: int | None = None) -> Any:
    """A text in sweep.json, or a number if it has a default.

    InputError if it is damaged, or lacks a text.
    """
    file = folder / ABOUT
    try:
        about = json.loads(file.read_text())
        value = about[key] if default is None else about.get(key, default)
        if not isinstance(value, str if default is None else int):
            raise ValueError(f"{key} is {value!r}")
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        raise InputError(
            f"{file}: damaged; put back a copy of it, or repeat the sweep in a new folder"
        ) from None
    return value


@dataclass(frozen=True)
class DataSet:
    """A sweep's folder. All its trials were run by one engine."""

    folder: Path
    engine_sha256: str

    @staticmethod
    def at(folder: Path, engine_sha256: str) -> "DataSet":
        """A folder to make, or to go on in if the same engine made it. Writes nothing."""
        try:
            if (folder / ABOUT).is_file():
                if about(folder, "engine_sha256") != engine_sha256:
                    raise InputError(
                        f"--out {folder}: another engine made the trials in it, and one data set "
                        "has one engine; name a new folder, or remove this one"
                    )
            elif folder.is_dir():
                if any(file != draft_name(folder / ABOUT) for file in folder.iterdir()):
                    raise InputError(f"--out {folder}: the folder is not empty; name a new one")
            elif folder.exists():
                raise InputError(f"--out {folder}: a file; name a folder")
        except OSError as error:
            raise InputError(f"--out {folder}: {cause_of(error)}; name another folder") from None
        return DataSet(folder, engine_sha256)

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Makes the folder; within, no other sweep may write into it. A kill lets go of it too."""
        with contextlib.ExitStack() as at_end:
            try:
                self.folder.mkdir(parents=True, exist_ok=True)
                folder = os.open(self.folder, os.O_RDONLY)
                at_end.callback(os.close, folder)
                fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(
                    f"--out {self.folder}: another sweep is at work in it; wait for it, or name "
                    "another folder"
                ) from None
            except OSError as error:
                # Some shared disks know no locks.
                if error.errno not in (errno.ENOLCK, errno.ENOTSUP, errno.EINVAL):
                    raise self._unusable(error) from None
            yield

    def begin(self, plan: Plan, keys: Sequence[str]) -> None:
        """Makes the folder this plan's. Tables of another plan are made anew of the parts."""
        rows = [(key, t.base, t.seed, t.settings) for t, key in zip(plan.trials, keys, strict=True)]
        about = {
            "name": plan.keys.name,
            "kilotwin": __version__,
            "engine_sha256": self.engine_sha256,
            "trials": len(rows),
            "trials_sha256": hashlib.sha256(json.dumps(rows, default=str).encode()).hexdigest(),
        }
        file = self.folder / ABOUT
        try:
            is_new = not file.is_file() or json.loads(file.read_text()) != about
            self.folder.mkdir(parents=True, exist_ok=True)
            if is_new:
                self._remove_tables()
                _replace(file, json.dumps(about, indent=2))
            _replace(self.folder / "sweep.toml", plan.text)
            self.parts.mend()
        except OSError as error:
            raise self._unusable(error) from None
        if is_new:
            self.assemble(plan, keys)

    def _unusable(self, error: OSError) -> InputError:
        return InputError(
            f"--out {self.folder}: {cause_of(error)}; see to the disk, or name another folder"
        )

    @cached_property
    def parts(self) -> Parts:
        """The finished trials, by their keys."""
        return Parts(self.folder / "parts")

    def failed_folder(self, key: str) -> Path:
        """Where the run folder of a failed trial goes."""
        return self.folder / "failed" / key

    def add(self, key: str, part: bytes) -> None:
        """Keeps a trial's result."""
        with self._writing():
            self.parts.add(key, part)

    def log(self, **line: Any) -> None:
        """Adds a line to the log; one that was cut before it stays a line of its own."""
        with self._writing(), (self.folder / "log.jsonl").open("a+b") as file:
            if file.tell():
                file.seek(-1, os.SEEK_END)
            cut = file.read(1) not in (b"", b"\n")
            file.write(b"\n" * cut + json.dumps(line).encode() + b"\n")

    def seconds_per_robot_second(self) -> float | None:
        """CPU time that a robot-second took in the trials so far; None without any."""
        file = self.folder / "log.jsonl"
        done = []
        for text in file.read_text(errors="replace").splitlines() if file.exists() else ():
            with contextlib.suppress(ValueError, KeyError, TypeError):
                line = json.loads(text)
                done.append((float(line["cpu_s"]), float(line["robot_s"])))
        robot_s = sum(robot_s for _, robot_s in done)
        return sum(cpu_s for cpu_s, _ in done) / robot_s if robot_s else None

    def assemble(self, plan: Plan, keys: Sequence[str]) -> int:
        """Writes the two tables from the finished ones of these trials; returns how many."""
        schemas: dict[str, pa.Schema] = {}
        for key in keys:
            stream = self.parts.read(key)
            if stream is not None:
                schemas[key] = pa.ipc.open_stream(stream).schema
        finished = [pair for pair in zip(plan.trials, keys, strict=True) if pair[1] in schemas]
        with self._writing():
            if not finished:
                self._remove_tables()
                return 0
            rows = [_row(trial, key, plan.varied, schemas[key]) for trial, key in finished]
            with draft_of(self.folder / SERIES) as series, draft_of(self.folder / TRIALS) as trials:
                _write_rows(trials, rows, plan)
                indexed = [(trial.index, key) for trial, key in finished]
                self._write_series(series, indexed, list(schemas.values()))
        return len(rows)

    def spoiled(self) -> list[str]:
        """Failures of metrics' functions in trials of the table: which, where and how."""
        if not (self.folder / TRIALS).exists():
            return []
        with pq.ParquetFile(self.folder / TRIALS) as file:
            if METRICS_FAILED not in file.schema_arrow.names:
                return []
            return list(filter(None, file.read([METRICS_FAILED])[METRICS_FAILED].to_pylist()))

    def _remove_tables(self) -> None:
        for table in (TRIALS, SERIES):
            (self.folder / table).unlink(missing_ok=True)

    def _write_series(
        self, draft: Path, indexed: Sequence[tuple[int, str]], schemas: list[pa.Schema]
    ) -> None:
        bare = [schema.remove_metadata() for schema in schemas]
        whole = pa.unify_schemas([pa.schema([("trial", pa.uint32())]), *dict.fromkeys(bare)])
        with pq.ParquetWriter(draft, whole, compression="zstd") as writer:
            waiting: list[pa.Table] = []
            for index, key in indexed:
                waiting.append(_part_rows(index, self.parts.read(key), whole))
                if sum(table.num_rows for table in waiting) >= _ROW_GROUP:
                    writer.write_table(pa.concat_tables(waiting))
                    waiting = []
            if waiting:
                writer.write_table(pa.concat_tables(waiting))

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        """A full disk costs no trial that is there."""
        try:
            yield
        except OSError as error:
            raise RunError(
                f"{self.folder}: cannot write ({cause_of(error)}); make room or see to the "
                "disk, then give the same command again"
            ) from None


def _part_rows(index: int, stream: bytes | None, whole: pa.Schema) -> pa.Table:
    """A part's rows with the trial's index and all columns of the data set; null if not its own."""
    assert stream is not None
    table = table_of(stream)
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
    for name, measured in result.get("metrics", {}).items():
        row[f"{METRIC}{name}"] = measured["value"]
    if failed := result.get("metrics_failed"):
        row[METRICS_FAILED] = "; ".join(f"{name}: {why}" for name, why in failed.items())
    row["rule"] = trial.base if experiment.controller is None else experiment.controller.rule
    row["reading"] = reading_name(experiment.reading, experiment.swarm.profile)
    row["informed"] = experiment.swarm.informed
    for site in result["resting"]:
        informed = experiment.swarm.informed > 0
        row[f"share_{site}"] = experiment.swarm.informed_for.get(site, 0.0) if informed else 0.0
    row["result_hash"] = result["result_hash"]
    return row


def _write_rows(draft: Path, rows: Sequence[Mapping[str, Any]], plan: Plan) -> None:
    names = list(dict.fromkeys(name for row in rows for name in row))
    # A varied value is text, a number or a list; a column has one type, so the rest becomes text.
    columns = {name: _column(name, [row.get(name) for row in rows]) for name in names}
    about = {"sweep": plan.keys.name, "kilotwin": __version__}
    pq.write_table(pa.table(columns).replace_schema_metadata(about), draft, compression="zstd")


def _column(name: str, values: Sequence[Any]) -> pa.Array:
    if name.startswith(METRIC) and name != METRICS_FAILED:
        return pa.array(values, pa.float64())
    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        return pa.array([None if value is None else float(value) for value in values])
    if len(kinds) > 1 or kinds & {dict, list}:
        return pa.array(
            [None if value is None else json.dumps(value, ensure_ascii=False) for value in values]
        )
    return pa.array(values)


def _replace(target: Path, content: str | bytes) -> None:
    with draft_of(target) as draft:
        draft.write_bytes(content.encode() if isinstance(content, str) else content)


def failure_line(key: str, failed: Failed) -> dict[str, Any]:
    """How a failure stands in the log and in --json."""
    folder = None if failed.folder is None else str(failed.folder)
    return {
        "key": key,
        "failed": failed.reason,
        "timed_out": failed.timed_out,
        "run_folder": folder,
    }
