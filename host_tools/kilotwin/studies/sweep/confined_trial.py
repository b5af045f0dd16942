"""A trial in a process that is confined as a run's worker is (docs/security.md).

The process is a fork of the executor's worker. It hands back bytes that this side checks, since a
program may have written them.
"""

import contextlib
import json
import pickle
import platform
import threading
from dataclasses import replace
from typing import Any

import numpy.ma  # noqa: F401 (numpy loads it at its first use, which would be in each fork)
import pyarrow as pa

from kilotwin import _emulator
from kilotwin.errors import KilotwinError
from kilotwin.runs.columns import Records
from kilotwin.session.black_box import BlackBox
from kilotwin.session.confined_worker import confine_trial, unconfined_because
from kilotwin.session.fork import Ended, run_in_fork
from kilotwin.session.job import Job
from kilotwin.studies.sweep import parts
from kilotwin.studies.sweep.measure import (
    GRACE_S,
    Failed,
    Measured,
    Task,
    clock_of,
    engine_sha256,
    job_of,
    measure,
    measure_job,
)
from kilotwin.studies.sweep.trial_helper import measure_by_helper, pipes


def measure_confined(task: Task) -> Measured | Failed:
    """Runs the trial in a confined fork; what brings that down comes back as Failed.

    Unconfined, in this process, where programs are trusted, and where the user's own Python takes
    part. A process with threads (a Dask worker) has a helper that forks.
    """
    if task.trusted or unconfined_because(task.experiment) or task.experiment.functions:
        return measure(task)
    if threading.active_count() > 1:
        return measure_by_helper(task)
    limit_s = None if task.timeout_s is None else task.timeout_s + GRACE_S
    try:
        job = job_of(task)
        ended = run_in_fork(lambda box: _work(task, job, box), task.experiment, limit_s)
    except KilotwinError as error:
        return Failed(task.key, str(error), None)
    return _answer(task, ended)


def serve(parent: int) -> None:
    """The helper of a thread of the process `parent`: answers its tasks until that ends."""
    _emulator.end_with_parent(parent)
    tasks, answers = pipes()
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            pickle.dump(measure_confined(pickle.load(tasks)), answers)
            answers.flush()


def _work(task: Task, job: Job, box: BlackBox) -> bytes:
    """In the fork: runs the trial; a head, and the part."""
    job = replace(job, black_box=str(box.path))
    answer = measure_job(task, job, clock_of(task.timeout_s), lambda: confine_trial(job))
    part = b""
    if isinstance(answer, Failed):
        head: dict[str, Any] = {"failed": answer.reason, "timed_out": answer.timed_out}
    else:
        head, part = {"cpu_s": answer.cpu_s}, answer.part
    return json.dumps(head).encode() + b"\n" + part


def _answer(task: Task, ended: Ended) -> Measured | Failed:
    if ended.late:
        why = f"stopped after trial_timeout_s = {task.timeout_s:g}, in which it did not come back"
        return Failed(task.key, why, None, timed_out=True)
    if number := ended.signal:
        return Failed(task.key, f"its process was ended by {number.name}", None)
    head, _, part = ended.said.partition(b"\n")
    try:
        told = json.loads(head)
        if "failed" in told:
            return Failed(task.key, str(told["failed"]), None, told["timed_out"] is True)
        cpu_s = float(told["cpu_s"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return Failed(task.key, "its process ended without a result", None)
    wanted = Records.of(task.experiment.keys, {}).sites_schema
    if not parts.is_whole(part) or not pa.ipc.open_stream(part).schema.equals(wanted):
        return Failed(task.key, "its process handed back what is no result", None)
    return Measured(task.key, part, cpu_s, engine_sha256(), platform.node())
