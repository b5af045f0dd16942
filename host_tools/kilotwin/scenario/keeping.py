"""Keeps a run that failed, to look at: its run folder, a map, a video."""

import contextlib
import shutil
from pathlib import Path

from kilotwin.build.guest import Notify
from kilotwin.errors import KilotwinError
from kilotwin.experiment.experiment import Experiment
from kilotwin.plot.figures import write_figure
from kilotwin.plot.video import Film, write_video
from kilotwin.runs.display import NoDisplay
from kilotwin.runs.folder import MANIFEST, slug
from kilotwin.runs.reader import Run
from kilotwin.runs.run import run

FAILED = Path("runs") / "failed"
"""Where they are kept."""


def keep(
    experiment: Experiment,
    command_line: list[str],
    timeout_s: float,
    notify: Notify,
    *,
    video: bool = False,
) -> Path | None:
    """Runs it once more, into a run folder that takes the place of an older one; None if it leaves
    none."""
    folder = FAILED / f"{slug(experiment.keys.name)}-seed{experiment.keys.seed}"
    if (folder / MANIFEST).exists():
        shutil.rmtree(folder)
    # A program that brings the process down leaves a folder to look at too.
    with contextlib.suppress(KilotwinError):
        run(experiment, folder, command_line, NoDisplay(), timeout_s=timeout_s)
    if not (folder / MANIFEST).exists():
        return None
    try:
        write_figure("map", folder, folder / "map.png")
        if video:
            write_video(Run.open(folder), folder / "run.mp4", Film(), lambda _share: None)
    except KilotwinError as error:
        notify(f"{folder}: {error}")
    return folder
