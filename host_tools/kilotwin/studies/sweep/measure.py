"""One trial, run where an executor puts it: in this process, without a run folder.

A trial that fails is run once more as `kilotwin run` would, in a process of its own and into a run
folder: so it can bring down nothing else, and leaves something to look at.
"""

import contextlib
import functools
import hashlib
import json
import math
import platform
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from kilotwin import _emulator
from kilotwin.errors import KilotwinError, TimeoutRunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.states import Counts, States, count
from kilotwin.metrics.values import NO_METRICS, MetricValues
from kilotwin.programs.group import build_all, symbols_of
from kilotwin.runs.causes import causes
from kilotwin.runs.columns import Records
from kilotwin.runs.reader import Run
from kilotwin.session import run
from kilotwin.session.display import NoDisplay
from kilotwin.session.job import Job
from kilotwin.session.trial import Trial

if TYPE_CHECKING:
    from kilotwin._emulator import Event, Samples

RESULT = b"result"
"""Under which the metadata of a part's schema has the trial's result."""

# After its time a trial ends within a second, unless the engine hangs.
GRACE_S = 10.0

# Keys of a run's summary that are the trial's result: the same on every machine.
RESULT_KEYS = ("robots", "resting", "not_resting", "result_hash", "final_hash")
_METRIC_KEYS = ("metrics", "metrics_failed")  # of trials that have any


@dataclass(frozen=True)
class Task:
    """One trial for a worker of an executor. `folder`: where a failed one is kept."""

    key: str
    experiment: Experiment
    folder: Path
    timeout_s: float | None = None
    """Wall time that it may take."""
    trusted: bool = False
    """Whether its programs are (--trust), wherever it runs."""


@dataclass(frozen=True)
class Measured:
    """A trial's part of the data set, and how it was made.

    `part`: its table `sites` as an Arrow stream, its result as JSON in the schema's metadata.
    """

    key: str
    part: bytes
    cpu_s: float
    engine_sha256: str
    host: str


@dataclass(frozen=True)
class Failed:
    """A trial that failed: why, and the run folder it left, if any.

    `timed_out`: it took too long, and would again.
    """

    key: str
    reason: str
    folder: Path | None
    timed_out: bool = False


@functools.cache
def engine_sha256() -> str:
    """Which engine this is: results of different ones do not belong into one data set."""
    assert _emulator.__file__ is not None
    return hashlib.sha256(Path(_emulator.__file__).read_bytes()).hexdigest()


def measure(task: Task) -> Measured | Failed:
    """Runs the trial here. What its programs or the engine refuse comes back as Failed.

    A trial that cannot be stopped in time, since the engine hangs, ends this process.
    """
    with deadline(task.timeout_s) as is_over:
        try:
            job = job_of(task)
        except KilotwinError as error:
            return Failed(task.key, str(error), None)
        return measure_job(task, job, is_over, lambda: None)


def job_of(task: Task) -> Job:
    """The job of a trial, with its programs built; KilotwinError if that cannot be."""
    guests, modules = build_all(task.experiment)
    return Job(
        task.experiment,
        [str(guest.file) for guest in guests],
        task.folder,
        {},
        None,
        "" if modules is None else str(modules.file),
        symbols=symbols_of(guests, modules),
    )


def measure_job(
    task: Task, job: Job, is_over: Callable[[], bool], confine: Callable[[], None]
) -> Measured | Failed:
    """Runs the trial in this process. `confine` is called before a program is loaded."""
    try:
        trial = Trial(job, lambda _: None, lambda: _SeriesWriter(task.experiment), confine)
        in_time = trial.run(is_over)
    except KilotwinError as error:
        return Failed(task.key, str(error), None)
    summary = trial.summary(interrupted=not in_time)
    trial.close()
    if not in_time:
        return Failed(task.key, _too_long(task, summary), None, timed_out=True)
    if summary["robots_failed"]:
        return Failed(task.key, _robots_failed(summary), None)
    return _measured(task, summary, trial.writer.batches)


def measure_apart(task: Task) -> Measured | Failed:
    """Runs the trial in a process of its own, into `task.folder`."""
    try:
        outcome = run.run(
            task.experiment,
            task.folder,
            ["kilotwin", "sweep"],
            NoDisplay(),
            timeout_s=task.timeout_s,
        )
    except KilotwinError as error:
        timed_out = isinstance(error, TimeoutRunError)
        folder = task.folder if task.folder.exists() else None
        return Failed(task.key, str(error), folder, timed_out)
    if outcome.timed_out:
        reason = _too_long(task, outcome.summary)
        return Failed(task.key, reason, task.folder, timed_out=True)
    if outcome.exit_code != 0:
        return Failed(task.key, _robots_failed(outcome.summary), task.folder)
    return _measured(task, outcome.summary, Run.open(task.folder).sites().to_batches())


def _measured(task: Task, summary: dict[str, Any], sites: list[pa.RecordBatch]) -> Measured:
    schema = Records.of(task.experiment.keys, {}).sites_schema
    part = part_of(
        pa.Table.from_batches(sites, schema).combine_chunks(),
        {
            **{key: summary[key] for key in RESULT_KEYS},
            **{key: summary[key] for key in _METRIC_KEYS if summary[key]},
        },
    )
    return Measured(task.key, part, summary["cpu_s"], engine_sha256(), platform.node())


def part_of(sites: pa.Table, result: dict[str, Any]) -> bytes:
    """A trial's part of the data set: the same bytes for the same rows and result."""
    table = sites.replace_schema_metadata({RESULT: json.dumps(result, sort_keys=True)})
    sink = pa.BufferOutputStream()
    options = pa.ipc.IpcWriteOptions(compression="zstd", use_threads=False)
    with pa.ipc.new_stream(sink, table.schema, options=options) as writer:
        writer.write_table(table)
    return bytes(sink.getvalue())


def clock_of(timeout_s: float | None) -> Callable[[], bool]:
    """Whether the time that begins now is over, as a function."""
    end = math.inf if timeout_s is None else time.monotonic() + timeout_s
    return lambda: time.monotonic() >= end


@contextlib.contextmanager
def deadline(timeout_s: float | None) -> Iterator[Callable[[], bool]]:
    """The same; some seconds later SIGALRM ends this process."""
    if timeout_s is not None:
        signal.setitimer(signal.ITIMER_REAL, timeout_s + GRACE_S)
    try:
        yield clock_of(timeout_s)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


def _too_long(task: Task, summary: dict[str, Any]) -> str:
    return (
        f"stopped after trial_timeout_s = {task.timeout_s:g}, when {summary['simulated_s']:,.1f} "
        f"of {summary['duration_s']:,g} s were simulated"
    )


def _robots_failed(summary: dict[str, Any]) -> str:
    found = causes(summary["robots_failed"])
    more = f"; and {len(found) - 1} other causes" if len(found) > 1 else ""
    return found[0].text("robot") + more


class _SeriesWriter:
    """Keeps the table `sites` in memory, in place of the writer of a run folder."""

    def __init__(self, experiment: Experiment) -> None:
        self._experiment = experiment
        self._states = States.of(experiment.keys)
        self._records = Records.of(experiment.keys, {})
        self.batches: list[pa.RecordBatch] = []

    def add(self, samples: "Samples", measured: MetricValues = NO_METRICS) -> Counts | None:
        if not len(samples["tick"]):
            return None
        counts = self.count(samples)
        self.batches.append(self._records.sites(samples, counts, measured))
        return counts

    def count(self, samples: "Samples") -> Counts:
        sites = len(self._experiment.keys.site)
        return count(self._states, samples["led"], samples["site"], sites)

    def add_events(self, events: "Iterable[Event | dict[str, Any]]") -> None:
        """Events of a trial that went well are not kept."""
