"""Where trials run: processes of this machine, or the workers of a Dask cluster.

All places (sweep/slurm.py has one more) are executors of `concurrent.futures`, so that the pool
does not know the difference.
"""

import contextlib
import os
import re
import signal
import sys
import types
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Protocol

from kilotwin import _emulator
from kilotwin.errors import DeviceError, InputError
from kilotwin.files import confinement, extras

_CONNECT_S = 5
_ADDRESS = re.compile(r"((tcp|tls|wss?|ucx)://)?([^\s:/]+|\[[0-9a-fA-F:.]+\]):\d{1,5}")


class Place(Protocol):
    """Opens an executor, again if the first one broke."""

    @property
    def name(self) -> str:
        """For people."""

    def open(self) -> contextlib.AbstractContextManager[Executor]:
        """An executor that is shut down at the end, without waiting for what runs."""

    def workers(self) -> int | None:
        """How many trials run at a time; None if that is not known before it is opened."""


@dataclass(frozen=True)
class Processes:
    """Processes of this machine."""

    number: int

    @property
    def name(self) -> str:
        """For people."""
        return f"{self.number} process{'es' if self.number > 1 else ''}"

    def workers(self) -> int:
        """As many as processes."""
        return self.number

    @contextlib.contextmanager
    def open(self) -> Iterator[Executor]:
        """A pool whose processes end at once when it is left, or this one dies."""
        # Spawned, not forked: a child of ours must not hold our threads' locks.
        pool = ProcessPoolExecutor(
            self.number, _Context(), initializer=_serve, initargs=(os.getpid(),)
        )
        try:
            yield pool
        finally:
            processes = list((pool._processes or {}).values())
            pool.shutdown(wait=False, cancel_futures=True)
            for process in processes:
                process.kill()


class _Worker(SpawnProcess):
    """Forks later: so it has no threads, and takes little memory in advance. It loads our modules
    alone: a user's script would be executed again."""

    def start(self) -> None:
        """Begins it in such surroundings."""
        main, before = sys.modules["__main__"], dict(os.environ)
        sys.modules["__main__"] = types.ModuleType("__main__")
        os.environ.update(confinement.SINGLE_THREADED)
        try:
            super().start()
        finally:
            sys.modules["__main__"] = main
            for name in confinement.SINGLE_THREADED:
                os.environ.pop(name)
                os.environ.update({name: before[name]} if name in before else {})


class _Context(SpawnContext):
    Process = _Worker


def _serve(parent: int) -> None:
    """In a worker: Ctrl-C is for the parent; when that is gone, so are we."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _emulator.end_with_parent(parent)


@dataclass(frozen=True)
class Dask:
    """The workers of a running Dask cluster."""

    address: str

    def __post_init__(self) -> None:
        extras.require("distributed")
        # The client would look for it for long, and then end without a word that helps.
        if not _ADDRESS.fullmatch(self.address):
            raise InputError(f"--dask {self.address}: not an address; try tcp://HOST:8786")

    @property
    def name(self) -> str:
        """For people."""
        return f"the Dask cluster at {self.address}"

    def workers(self) -> None:
        """Unknown until the scheduler is contacted; workers come and go."""

    @contextlib.contextmanager
    def open(self) -> Iterator[Executor]:
        """DeviceError if nothing answers at the address."""
        from distributed import Client

        try:
            client = Client(self.address, timeout=_CONNECT_S, set_as_default=False)
        except (OSError, TimeoutError) as error:
            raise DeviceError(
                f"--dask {self.address}: no scheduler answers ({error}); start one with "
                "`dask scheduler` and workers with `dask worker --nthreads 1`"
            ) from None
        with client:
            # Each engine has one thread; a worker of several would run trials side by side.
            yield client.get_executor(pure=False)


def place_for(processes: int | None, dask: str | None) -> Place:
    """Where trials run: in processes, one per core unless said, or on a Dask cluster."""
    return Dask(dask) if dask else Processes(processes or len(os.sched_getaffinity(0)))
