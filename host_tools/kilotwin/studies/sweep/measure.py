"""The part of a sweep's data set that comes of one trial, and its second try.

A trial that fails is run once more as `kilotwin run` would, in a process of its own and into a run
folder, so that it leaves something to look at.
"""

import json
import platform
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from kilotwin.errors import KilotwinError, RunError, TimeoutRunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.states import Counts, States, count
from kilotwin.metrics.values import NO_METRICS, MetricValues
from kilotwin.runs.causes import robots_failed
from kilotwin.runs.columns import sites_rows, sites_schema
from kilotwin.runs.reader import Run
from kilotwin.session import run
from kilotwin.session.display import NoDisplay
from kilotwin.studies.pool.series import engine_sha256
from kilotwin.studies.pool.task import Answer, Done, Failed, Outcome, Ran, Task

if TYPE_CHECKING:
    from kilotwin._emulator import Event, Samples

RESULT = b"result"
"""Under which the metadata of a part's schema has the trial's result."""

TIMEOUT = "trial_timeout_s"

# Keys of a run's summary that are the trial's result: the same on every machine.
RESULT_KEYS = ("robots", "resting", "not_resting", "result_hash", "final_hash")
_METRIC_KEYS = ("metrics", "metrics_failed")  # of trials that have any
# A smaller table is not worth the time that its compression takes.
_LARGE_BYTES = 1 << 14
_STREAM_END = b"\xff\xff\xff\xff\0\0\0\0"


class Rows(Outcome["SeriesWriter", bytes]):
    """A trial's part: its table `sites` as an Arrow stream, its result as JSON in the schema's
    metadata. A trial in which a robot's program failed has none."""

    def writer(self, experiment: Experiment) -> "SeriesWriter":
        """Keeps the table."""
        return SeriesWriter(experiment)

    def answer(self, ran: "Ran[SeriesWriter]") -> bytes:
        """The part; RunError of a program that failed."""
        if ran.summary["robots_failed"]:
            raise RunError(robots_failed(ran.summary["robots_failed"]))
        writer = ran.trial.writer
        return _part(writer.schema, ran.summary, writer.batches)

    def understood(self, task: Task[bytes], said: bytes) -> bytes:
        """The same bytes; ValueError if they are no whole part of this experiment."""
        wanted = sites_schema(task.experiment.keys, {})
        if not is_whole(said, wanted):
            raise ValueError
        return said


@dataclass(frozen=True)
class Apart:
    """Runs the trial in a process of its own, into `folder`, which is not there yet."""

    task: Task[bytes]
    folder: Path

    def __call__(self) -> Answer[bytes]:
        """Its part, or why it failed, with the run folder."""
        task, folder = self.task, self.folder
        try:
            outcome = run.run(
                task.experiment,
                folder,
                ["kilotwin", "sweep"],
                NoDisplay(),
                timeout_s=task.timeout_s,
            )
        except KilotwinError as error:
            timed_out = isinstance(error, TimeoutRunError)
            return Failed(str(error), timed_out, folder if folder.exists() else None)
        if outcome.timed_out:
            return Failed(task.stopped_when(outcome.summary), True, folder)
        if outcome.exit_code != 0:
            return Failed(robots_failed(outcome.summary["robots_failed"]), folder=folder)
        sites = Run.open(folder).sites().to_batches()
        schema = sites_schema(task.experiment.keys, {})
        part = _part(schema, outcome.summary, sites)
        return Done(part, outcome.summary["cpu_s"], engine_sha256(), platform.node())


def _part(schema: pa.Schema, summary: dict[str, Any], sites: list[pa.RecordBatch]) -> bytes:
    return part_of(
        pa.Table.from_batches(sites, schema).combine_chunks(),
        {
            **{key: summary[key] for key in RESULT_KEYS},
            **{key: summary[key] for key in _METRIC_KEYS if summary[key]},
        },
    )


def part_of(sites: pa.Table, result: dict[str, Any]) -> bytes:
    """A trial's part of the data set: the same bytes for the same rows and result."""
    table = sites.replace_schema_metadata({RESULT: json.dumps(result, sort_keys=True)})
    sink = pa.BufferOutputStream()
    compression = "zstd" if table.nbytes > _LARGE_BYTES else None
    options = pa.ipc.IpcWriteOptions(compression=compression, use_threads=False)
    with pa.ipc.new_stream(sink, table.schema, options=options) as writer:
        writer.write_table(table)
    return bytes(sink.getvalue())


def table_of(part: bytes) -> pa.Table:
    """The table of a part, whose schema has the result; read without threads, which take longer
    than the table."""
    options = pa.ipc.IpcReadOptions(use_threads=False)
    return pa.ipc.open_stream(part, options=options).read_all()


def is_whole(content: bytes, schema: pa.Schema) -> bool:
    """Whether it is a whole stream with these columns and a result."""
    if not content.endswith(_STREAM_END):
        return False
    try:
        table = table_of(content)
        table.validate(full=True)
        has_all = set(json.loads(table.schema.metadata[RESULT])) >= set(RESULT_KEYS)
        return has_all and bool(table.schema.equals(schema))
    except (pa.ArrowException, OSError, TypeError, KeyError, ValueError):
        return False


class SeriesWriter:
    """Keeps the table `sites` in memory, in place of the writer of a run folder."""

    def __init__(self, experiment: Experiment) -> None:
        self._experiment = experiment
        self._states = States.of(experiment.keys)
        self.schema = sites_schema(experiment.keys, {})
        self.batches: list[pa.RecordBatch] = []

    def add(self, samples: "Samples", measured: MetricValues = NO_METRICS) -> Counts | None:
        """Takes samples of the engine."""
        if not len(samples["tick"]):
            return None
        counts = self.count(samples)
        self.batches.append(sites_rows(self.schema, samples, counts, measured))
        return counts

    def count(self, samples: "Samples") -> Counts:
        """How many robots do what, in each of the samples."""
        sites = len(self._experiment.keys.site)
        return count(self._states, samples["led"], samples["site"], sites)

    def add_events(self, events: "Iterable[Event | dict[str, Any]]") -> None:
        """Events of a trial that went well are not kept."""
