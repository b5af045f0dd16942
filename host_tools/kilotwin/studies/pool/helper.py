"""Trials for a process with threads, as a Dask worker is: a fork of that cannot be used.

Each thread that runs trials starts a helper once, a process without threads. It runs them as a
worker of this machine does (series.py), and passes the answers on. Starting it takes half a second;
then a trial costs what it costs on this machine.
"""

import contextlib
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, BinaryIO, TypeVar

from kilotwin import _emulator
from kilotwin.files.confinement import SINGLE_THREADED
from kilotwin.studies.pool.task import Failed, Task

if TYPE_CHECKING:
    from kilotwin.studies.pool.task import Answer

# The helper's program, which gets its parent's process id.
_SERVER = "from kilotwin.studies.pool.helper import serve; serve({})"

_of_thread = threading.local()
T = TypeVar("T")


class _Helper:
    """A process that runs `serve()`. It ends with the thread that made it."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _SERVER.format(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **SINGLE_THREADED},
        )

    def run(self, tasks: Sequence[Task[Any]]) -> list[Any]:
        """OSError, EOFError or UnpicklingError if the helper ends meanwhile."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        pickle.dump(tasks, self._process.stdin)
        self._process.stdin.flush()
        answers = pickle.load(self._process.stdout)
        assert isinstance(answers, list)
        return answers

    def end(self) -> None:
        self._process.kill()
        with contextlib.suppress(OSError):
            self._process.communicate()


def run_by_helper(tasks: Sequence[Task[T]]) -> "list[Answer[T]]":
    """Runs trials by this thread's helper. A helper that ends costs them, and is replaced."""
    helper: _Helper | None = getattr(_of_thread, "helper", None)
    if helper is None:
        helper = _of_thread.helper = _Helper()
    try:
        return helper.run(tasks)
    except (OSError, EOFError, pickle.UnpicklingError):
        helper.end()
        _of_thread.helper = None
        return [Failed("the process that ran it ended without a result") for _ in tasks]


def serve(parent: int) -> None:
    """The helper of a thread of the process `parent`: answers its tasks until that ends."""
    from kilotwin.studies.pool.series import run_series

    _emulator.end_with_parent(parent)
    tasks, answers = _pipes()
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            pickle.dump(run_series(pickle.load(tasks)), answers)
            answers.flush()


def _pipes() -> tuple[BinaryIO, BinaryIO]:
    """In the helper: tasks in, answers out, away from what a fork keeps open."""
    tasks, answers = os.dup(0), os.dup(1)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    return os.fdopen(tasks, "rb"), os.fdopen(answers, "wb")
