"""The process in which a run's worker runs: a fork of this one, or a Python of its own.

A fork has this process's libraries and its job, which halves the time a short run takes. Only a
process with one thread can be forked safely; a notebook, for one, starts a Python.
"""

import contextlib
import fcntl
import os
import pickle
import resource
import signal
import subprocess
import sys
import time
import traceback
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import IO, NoReturn, Protocol, Self

from kilotwin.files.confinement import SINGLE_THREADED
from kilotwin.session import worker
from kilotwin.session.confined_worker import unconfined_because
from kilotwin.session.job import Job

_THREADS_END_S = 0.05


class WorkerProcess(Protocol):
    """The part of a process that a run needs; a subprocess.Popen has it too.

    Left as a context, its pipes are closed and its end is awaited.
    """

    pid: int

    @property
    def stdin(self) -> IO[bytes] | None: ...
    @property
    def stdout(self) -> IO[bytes] | None: ...
    def __enter__(self) -> Self: ...
    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...

    def kill(self) -> None:
        """Ends it at once, if it has not ended."""

    def wait(self) -> int:
        """Its exit code at its end; -N if signal N ended it."""


def start_worker(job: Job, log: IO[str]) -> WorkerProcess:
    """Starts the worker of `job`; what it and its programs print goes into `log`.

    It has a process group of its own: Ctrl-C reaches only this process, which then stops it.
    """
    return _Fork(job, log) if _can_fork() else _python(job, log)


def _can_fork() -> bool:
    """Whether this process has one thread, and libraries that start none later."""
    if any(os.environ.get(name) != SINGLE_THREADED[name] for name in SINGLE_THREADED):
        return False
    # A thread that was joined takes a moment to be gone.
    ends = time.monotonic() + _THREADS_END_S
    while not (alone := _has_one_thread()) and time.monotonic() < ends:
        time.sleep(0.001)
    return alone


def _has_one_thread() -> bool:
    return sum(1 for _ in Path("/proc/self/task").iterdir()) == 1


def _python(job: Job, log: IO[str]) -> WorkerProcess:
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "kilotwin.session.worker", str(os.getpid())],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=log,
        process_group=0,
        pass_fds=job.viewers,
        env={**os.environ, **({} if unconfined_because(job.experiment) else SINGLE_THREADED)},
    )
    assert process.stdin is not None
    with contextlib.suppress(BrokenPipeError):
        pickle.dump(job, process.stdin)
        process.stdin.flush()
    return process


class _Fork:
    """A fork of this process as a WorkerProcess."""

    def __init__(self, job: Job, log: IO[str]) -> None:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()  # the fork has no second copy to print
        orders, reports, parent = os.pipe(), os.pipe(), os.getpid()
        self._returncode: int | None = None
        self.pid = os.fork()
        if self.pid == 0:
            _be_worker(job, parent, (orders[0], reports[1], log.fileno()))
        os.close(orders[0])
        os.close(reports[1])
        self.stdin: IO[bytes] = os.fdopen(orders[1], "wb")
        self.stdout: IO[bytes] = os.fdopen(reports[0], "rb")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for pipe in (self.stdin, self.stdout):
            with contextlib.suppress(BrokenPipeError):
                pipe.close()
        self.wait()

    def kill(self) -> None:
        """Ends it at once, if it has not ended."""
        if self._returncode is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)

    def wait(self) -> int:
        """Its exit code at its end; -N if signal N ended it."""
        if self._returncode is None:
            _, status = os.waitpid(self.pid, 0)
            self._returncode = os.waitstatus_to_exitcode(status)
        return self._returncode


def _be_worker(job: Job, parent: int, files: tuple[int, int, int]) -> NoReturn:
    """In the child: `files` become its stdin, stdout and stderr, and it has no others but the
    links to viewers."""
    code = 1
    try:
        os.setpgid(0, 0)
        kept = (*files, *job.viewers)
        # Theirs may be 0 to 3 themselves, where this process was started without those.
        safe = [fcntl.fcntl(file, fcntl.F_DUPFD, len(kept)) for file in kept]
        for number, file in enumerate(safe):
            os.dup2(file, number)
        os.closerange(len(kept), resource.getrlimit(resource.RLIMIT_NOFILE)[0])
        job = replace(job, viewers=tuple(range(len(files), len(kept))))
        for number in (signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        sys.stdin = os.fdopen(0, encoding="utf-8", closefd=False)
        worker.serve(job, parent)
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(code)
