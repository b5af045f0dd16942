"""Confines the process of a run before its programs are loaded, once its files are open."""

import math
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from kilotwin import _emulator
from kilotwin.errors import RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.files import confinement
from kilotwin.files.confined_process import FILE_BYTES, confine_process
from kilotwin.runs.size import size_of
from kilotwin.session.growth import Growth
from kilotwin.session.job import Job

# More than the log of a full table's buses takes, and than a trace of all pins of a chip.
_BUSES_BYTES_PER_S, _TRACE_BYTES_PER_S = 4_000_000, 40_000_000
# Files beside those of prints, and how many of them may grow to the bound of one.
_FILES, _FULL_FILES = 1000, 4


def unconfined_because(experiment: Experiment) -> str:
    """Why runs of this experiment are not confined unless it is required; "" if they are."""
    if confinement.mode() == "off":
        return "programs are trusted (--trust)"
    if confinement.mode() == "auto" and experiment.environment is not None:
        return "the environment's Python program runs in the same process"
    return ""


def confine_worker(job: Job) -> dict[str, Any]:
    """Leaves this process the run folder, and returns the manifest's entry on it.

    RunError if it is required and the kernel cannot.
    """
    if why := unconfined_because(job.experiment):
        return {"confined": False, "not_confined": [why]}
    missing = _check_kernel()
    load_libraries(job.experiment)
    if job.viewers or job.acts:
        import kilotwin.session.live
        import kilotwin.session.steering  # noqa: F401 (a confined process could not)
    if threading.active_count() > 1:
        missing.append("threads that were there before keep their files")
    confine_process(
        job.experiment.size,
        readable=[*map(Path, job.all_guests), *(Path(faster).parent for _, faster in job.faster)],
        writable=[job.folder, *_black_box_of(job)],
        loads_later=bool(job.faster),
        most_written=_most_written(job),
        sockets=job.serving is not None or job.probes.gdb is not None,
    )
    return {"confined": not missing, "not_confined": missing}


def growth_of(job: Job) -> Growth:
    """The bound on the run folder of a confined worker: a file of prints for each robot, and those
    of its tables, of which none is full."""
    most_bytes = _FULL_FILES * (FILE_BYTES + _most_written(job))
    return Growth(job.folder, _FILES + job.experiment.size, most_bytes)


def _most_written(job: Job) -> int:
    """Bytes of the longest file that the run may make, with much to spare."""
    keys = job.experiment.keys
    of_time = _TRACE_BYTES_PER_S * bool(job.probes.vcd) + _BUSES_BYTES_PER_S * bool(keys.grid)
    return 4 * size_of(keys).estimated_bytes + math.ceil(keys.duration_s * of_time)


def load_libraries(experiment: Experiment) -> None:
    """Imports what is needed late, and a confined process could not load."""
    import pyarrow.parquet

    pyarrow.array([0])  # the first array of a process loads pandas, where that is installed
    if experiment.plan is not None:
        from kilotwin.table.grid.frames import fixed

        fixed()
    if experiment.environment is not None:
        pass


def confine_trials(jobs: Sequence[Job]) -> None:
    """Confines this process, a fork that does nothing but trials of the same programs: it may write
    no file. What the kernel lacks is left out; RunError if it is required.
    """
    _check_kernel()
    first = jobs[0]
    symbols = [file for file in first.symbols if file is not None]  # metrics read variables by them
    confine_process(
        max(job.experiment.size for job in jobs),
        readable=[*map(Path, first.all_guests), *symbols],
        writable=_black_box_of(first),
    )


def _check_kernel() -> list[str]:
    """The layers that the kernel lacks; RunError if there are any, and all are required."""
    missing = _emulator.lacking_layers()
    if confinement.mode() == "require" and missing:
        raise RunError(f"--confine=require: {missing[0]}; use a newer kernel, or leave it out")
    return missing


def _black_box_of(job: Job) -> list[Path]:
    return [] if job.black_box is None else [Path(job.black_box)]
