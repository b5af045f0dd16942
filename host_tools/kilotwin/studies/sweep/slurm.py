"""Jobs of Slurm as the place of a sweep's trials, and the choice of a place."""

import contextlib
import shutil
from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

from kilotwin.errors import DeviceError, InputError
from kilotwin.studies.pool.places import Place, place_for
from kilotwin.studies.sweep.plan import Plan, SlurmOptions


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


def choose_place(plan: Plan, processes: int | None, dask: str | None, slurm: bool) -> Place:
    """The same, or in jobs of Slurm."""
    if slurm and not dask:
        jobs = Slurm(plan.keys.slurm, plan.origin.where(("slurm",)))
        jobs.job_script()  # what is wrong with the options is reported before anything is written
        return jobs
    return place_for(processes, dask)
