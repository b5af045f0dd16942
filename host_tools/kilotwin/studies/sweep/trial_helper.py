"""Confined trials for a process with threads, as a Dask worker is: a fork of that cannot be used.

Each thread that runs trials starts a helper once, a process without threads. It forks for each
trial as a sweep's own worker does (confined_trial.py), checks what the fork hands back, and passes
the answer on. Starting it takes half a second; then a trial costs what it costs on this machine.
"""

import contextlib
import os
import pickle
import subprocess
import sys
import threading
from typing import BinaryIO

from kilotwin.files.confinement import SINGLE_THREADED
from kilotwin.studies.sweep.measure import Failed, Measured, Task

# The helper's program, which gets its parent's process id.
_SERVER = "from kilotwin.studies.sweep.confined_trial import serve; serve({})"

_of_thread = threading.local()


class _Helper:
    """A process that runs `serve()`. It ends with the thread that made it."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _SERVER.format(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **SINGLE_THREADED},
        )

    def measure(self, task: Task) -> Measured | Failed:
        """OSError, EOFError or UnpicklingError if the helper ends meanwhile."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        pickle.dump(task, self._process.stdin)
        self._process.stdin.flush()
        answer = pickle.load(self._process.stdout)
        assert isinstance(answer, Measured | Failed)
        return answer

    def end(self) -> None:
        self._process.kill()
        with contextlib.suppress(OSError):
            self._process.communicate()


def measure_by_helper(task: Task) -> Measured | Failed:
    """Runs the trial in a confined fork of this thread's helper. A helper that ends is replaced."""
    helper: _Helper | None = getattr(_of_thread, "helper", None)
    if helper is None:
        helper = _of_thread.helper = _Helper()
    try:
        return helper.measure(task)
    except (OSError, EOFError, pickle.UnpicklingError):
        helper.end()
        _of_thread.helper = None
        return Failed(task.key, "the process that ran it ended without a result", None)


def pipes() -> tuple[BinaryIO, BinaryIO]:
    """In the helper: tasks in, answers out, away from what a fork keeps open."""
    tasks, answers = os.dup(0), os.dup(1)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    return os.fdopen(tasks, "rb"), os.fdopen(answers, "wb")
