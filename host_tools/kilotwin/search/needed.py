"""Needs of both searches: their libraries, and a place to run trials."""

import importlib.util
import os

from kilotwin.errors import RunError
from kilotwin.sweep.executors import Dask, Place, Processes

_LIBRARIES = ("optuna", "cmaes", "SALib")


def check() -> None:
    """RunError that says what to install."""
    for name in _LIBRARIES:
        if importlib.util.find_spec(name) is None:
            raise RunError(f"{name} is not installed; type: pip install 'kilotwin[optimise]'")


def place(processes: int | None, dask: str | None) -> Place:
    """Where trials run: in processes, one per core unless said, or on a Dask cluster."""
    return Dask(dask) if dask else Processes(processes or len(os.sched_getaffinity(0)))
