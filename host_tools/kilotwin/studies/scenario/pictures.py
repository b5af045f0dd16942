"""Pictures of a run that failed: loaded where there is one, since drawing needs matplotlib."""

from pathlib import Path

from kilotwin.runs.reader import Run
from kilotwin.studies.plot.figures import write_figure
from kilotwin.studies.plot.video import Film, write_video

MAP = "map.png"


def draw(folder: Path, *, video: bool) -> None:
    """Draws map.png into a run folder, and run.mp4; KilotwinError says what cannot be drawn."""
    write_figure("map", folder, folder / MAP)
    if video:
        write_video(Run.open(folder), folder / "run.mp4", Film(), lambda _share: None)
