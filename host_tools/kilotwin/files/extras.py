"""Libraries that a plain install leaves out, for their size: the extras of pyproject.toml."""

import importlib.util

from kilotwin.errors import RunError

EXTRAS = {
    "SALib": "optimise",
    "cmaes": "optimise",
    "dask_jobqueue": "slurm",
    "distributed": "dask",
    "gcovr": "coverage",
    "imageio_ffmpeg": "video",
    "matplotlib": "plot",
    "mcap": "mcap",
    "optuna": "optimise",
    "pytest": "test",
    "scipy": "stats",
}
"""Which extra brings a library, by the name that it is imported by."""


def require(*libraries: str) -> None:
    """RunError that says what to install, if one of them is not. Loads nothing."""
    for name in libraries:
        if importlib.util.find_spec(name) is None:
            raise _lacks(name)


def explained(error: ModuleNotFoundError) -> RunError:
    """The error to show where the import of a library failed; of others, the error itself."""
    name = (error.name or "").partition(".")[0]
    if name not in EXTRAS:
        raise error
    return _lacks(name)


def _lacks(name: str) -> RunError:
    return RunError(f"{name} is not installed; type: pip install 'kilotwin[{EXTRAS[name]}]'")
