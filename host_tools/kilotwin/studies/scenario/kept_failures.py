"""Keeps a run that failed, to look at."""

import contextlib
import shutil
from pathlib import Path

from kilotwin.errors import KilotwinError
from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.folder import MANIFEST, slug
from kilotwin.session.display import NoDisplay
from kilotwin.session.run import run

FAILED = Path("runs") / "failed"
"""Where they are kept."""


def keep(
    experiment: Experiment,
    command_line: list[str],
    timeout_s: float,
    below: Path = FAILED,
) -> Path | None:
    """Runs it once more, into a run folder that takes the place of an older one; None if it leaves
    none."""
    folder = free(below / f"{slug(experiment.keys.name)}-seed{experiment.keys.seed}")
    # A program that brings the process down leaves a folder to look at too.
    with contextlib.suppress(KilotwinError):
        run(experiment, folder, command_line, NoDisplay(), timeout_s=timeout_s)
    if not (folder / MANIFEST).exists():
        return None
    return folder


def free(folder: Path) -> Path:
    """The folder, without the run that an earlier test has left there."""
    if (folder / MANIFEST).exists():
        shutil.rmtree(folder)
    return folder
