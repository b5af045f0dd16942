"""Where trials run: processes of this machine, the workers of a Dask cluster, or jobs of Slurm.

All are executors of `concurrent.futures`, so that the sweep does not know the difference.
"""

import contextlib
import os
import re
import shutil
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any, Protocol

from kilotwin import _emulator
from kilotwin.errors import DeviceError, InputError
from kilotwin.files import confinement, extras
from kilotwin.studies.sweep.plan import Plan, SlurmOptions

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
        """A pool whose processes end at once when the sweep ends or dies."""
        # Workers fork confined trials: without threads, and with little memory taken in advance.
        if confinement.mode() != "off":
            os.environ.update(confinement.SINGLE_THREADED)
        # Spawned, not forked: a child of ours must not hold our threads' locks.
        pool = ProcessPoolExecutor(
            self.number, get_context("spawn"), initializer=_serve, initargs=(os.getpid(),)
        )
        try:
            yield pool
        finally:
            processes = list((pool._processes or {}).values())
            pool.shutdown(wait=False, cancel_futures=True)
            for process in processes:
                process.kill()


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


@dataclass(frozen=True)
class Slurm:
    """Jobs of one core each, requested from Slurm by dask-jobqueue.

    `options` are the sweep's [slurm]; `where` they stand, for messages.
    """

    options: SlurmOptions
    where: str

    @property
    def name(self) -> str:
        """For people."""
        return "jobs of Slurm"

    def workers(self) -> int:
        """As many as jobs are requested."""
        return self.options.jobs

    def job_script(self) -> str:
        """The script that goes to sbatch."""
        with self._cluster() as cluster:
            return str(cluster.job_script())

    @contextlib.contextmanager
    def open(self) -> Iterator[Executor]:
        """DeviceError where there is no Slurm."""
        from distributed import Client

        # dask-jobqueue would only log that it cannot submit, and wait for ever.
        if shutil.which("sbatch") is None:
            raise DeviceError("--slurm: sbatch is not there; run this where Slurm is")
        with self._cluster() as cluster, Client(cluster, set_as_default=False) as client:
            cluster.scale(jobs=self.workers())
            yield client.get_executor(pure=False)

    @contextlib.contextmanager
    def _cluster(self) -> Iterator[Any]:
        from dask_jobqueue import SLURMCluster

        own = self.options.model_dump(exclude={"jobs"})
        try:
            fixed = {"cores": 1, "processes": 1, "n_workers": 0}
            cluster = SLURMCluster(**{"job_name": "kilotwin", **own, **fixed})
        except (TypeError, ValueError, RuntimeError) as error:
            what = str(error).partition("\n")[0].partition(". ")[0]
            raise InputError(
                f"{self.where}: [slurm]: {what}; allowed: what dask-jobqueue's SLURMCluster takes, "
                "and jobs"
            ) from None
        with cluster:
            yield cluster


def place_for(processes: int | None, dask: str | None) -> Place:
    """Where trials run: in processes, one per core unless said, or on a Dask cluster."""
    return Dask(dask) if dask else Processes(processes or len(os.sched_getaffinity(0)))


def choose_place(plan: Plan, processes: int | None, dask: str | None, slurm: bool) -> Place:
    """The same, or in jobs of Slurm."""
    if slurm and not dask:
        jobs = Slurm(plan.keys.slurm, plan.origin.where(("slurm",)))
        jobs.job_script()  # what is wrong with the options is reported before anything is written
        return jobs
    return place_for(processes, dask)
