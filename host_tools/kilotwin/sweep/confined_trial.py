"""A trial in a process that is confined as a run's worker is (docs/security.md).

The process is a fork of the executor's worker, which has all libraries loaded: that takes
milliseconds, where `kilotwin run` takes half a second. It hands back bytes that this side checks,
since a program may have written them.
"""

import contextlib
import json
import os
import pickle
import platform
import resource
import signal
import threading
from typing import Any, NoReturn

import numpy.ma  # noqa: F401 (numpy loads it at its first use, which would be in each fork)
import pyarrow as pa

from kilotwin import _emulator
from kilotwin.errors import KilotwinError
from kilotwin.runs.columns import Records
from kilotwin.runs.confined_worker import confine_trial, load_libraries, unconfined_because
from kilotwin.sweep import parts
from kilotwin.sweep.measure import (
    Failed,
    Measured,
    Task,
    deadline,
    engine_sha256,
    job_of,
    measure,
    measure_job,
)
from kilotwin.sweep.trial_helper import measure_by_helper, pipes

# A head is a line of text.
_HEAD_MOST = 1 << 16
_PART_MOST = 1 << 30


def measure_confined(task: Task) -> Measured | Failed:
    """Runs the trial in a confined fork; what brings that down comes back as Failed.

    Unconfined, in this process, where programs are trusted, and where the user's own Python takes
    part. A process with threads (a Dask worker) has a helper that forks.
    """
    if task.trusted or unconfined_because(task.experiment) or task.experiment.functions:
        return measure(task)
    if threading.active_count() > 1:
        return measure_by_helper(task)
    try:
        job = job_of(task)
        load_libraries(task.experiment)  # once for all trials
    except KilotwinError as error:
        return Failed(task.key, str(error), None)
    receive, send = os.pipe()
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        _be_trial(task, job, send, parent)
    os.close(send)
    with os.fdopen(receive, "rb") as pipe:
        said = pipe.read(_HEAD_MOST + _PART_MOST)
    _, status = os.waitpid(child, 0)
    return _answer(task, said, status)


def serve(parent: int) -> None:
    """The helper of a thread of the process `parent`: answers its tasks until that ends."""
    _emulator.end_with_parent(parent)
    tasks, answers = pipes()
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            pickle.dump(measure_confined(pickle.load(tasks)), answers)
            answers.flush()


def _be_trial(task: Task, job: Any, send: int, parent: int) -> NoReturn:
    """In the child: runs the trial, writes a head and the part, and ends without cleaning up."""
    code = 1
    with contextlib.suppress(BaseException):
        _emulator.end_with_parent(parent)
        # The executor's pipes are not for programs.
        os.closerange(3, send)
        os.closerange(send + 1, resource.getrlimit(resource.RLIMIT_NOFILE)[0])
        with deadline(task.timeout_s) as is_over:
            answer = measure_job(task, job, is_over, lambda: confine_trial(task.experiment))
        part = b""
        if isinstance(answer, Failed):
            head: dict[str, Any] = {"failed": answer.reason, "timed_out": answer.timed_out}
        else:
            head, part = {"cpu_s": answer.cpu_s}, answer.part
        left = memoryview(json.dumps(head).encode() + b"\n" + part)
        while left:
            left = left[os.write(send, left) :]
        code = 0
    os._exit(code)


def _answer(task: Task, said: bytes, status: int) -> Measured | Failed:
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        timed_out = number == signal.SIGALRM and task.timeout_s is not None
        reason = f"its process was ended by {signal.Signals(number).name}"
        return Failed(task.key, reason, None, timed_out)
    head, _, part = said.partition(b"\n")
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
