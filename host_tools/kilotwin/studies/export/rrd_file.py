"""A run as RRD, the file that Rerun opens. https://rerun.io

table/...     outlines of arena, sites, obstacles
robots        points in the colours of their LEDs, and arrows to their fronts
counts/...    a curve for each column of sites
events        events and prints

Rerun's two-dimensional views have y downwards; so all is in three dimensions, seen from above.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from kilotwin.errors import InputError, cause_of
from kilotwin.files import extras
from kilotwin.files.drafts import draft_of
from kilotwin.runs.reader import Run
from kilotwin.studies.export.moving_robots import Moment, MovingRobots

_TIME = "time"
_MOST_POINTS = 200_000


def write_rrd(run: Run, target: Path) -> str:
    """Writes the file; returns a line that says what is in it.

    InputError: a run without places or samples, a place that cannot be written. RunError: the
    library is not installed.
    """
    extras.require("rerun")
    import rerun  # an extra

    robots = MovingRobots(run)
    try:
        with draft_of(target) as draft:
            draft.touch()
            recording = rerun.RecordingStream("kilotwin", recording_id=run.folder.name)
            recording.save(draft)
            try:
                _write_table(rerun, recording, robots)
                _write_robots(rerun, recording, robots)
                _write_counts(rerun, recording, run.sites())
                _write_events(rerun, recording, run)
            finally:
                recording.flush()
                recording.disconnect()
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"--rrd {target}: cannot be written ({reason}); name another") from None
    return f"{target}: {robots.number:,} samples"


def _write_table(rerun: Any, recording: Any, robots: MovingRobots) -> None:
    recording.log("/", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for outline in robots.outlines():
        closed = _flat(np.vstack([outline.corners, outline.corners[:1]]))
        lines = rerun.LineStrips3D([closed], colors=[outline.colour], labels=[outline.name])
        recording.log(["table", outline.name], lines, static=True)


def _write_robots(rerun: Any, recording: Any, robots: MovingRobots) -> None:
    """Samples by the hundred: a call costs more than a sample."""
    waiting: list[Moment] = []
    points = 0
    for moment in robots.moments():
        waiting.append(moment)
        points += len(moment.places)
        if points >= _MOST_POINTS:
            _send(rerun, recording, waiting, robots.radius_m)
            waiting, points = [], 0
    if waiting:
        _send(rerun, recording, waiting, robots.radius_m)


def _send(rerun: Any, recording: Any, moments: list[Moment], radius_m: float) -> None:
    times = [rerun.TimeColumn(_TIME, duration=[moment.time_s for moment in moments])]
    sizes = [len(moment.places) for moment in moments]
    places = _flat(np.vstack([moment.places for moment in moments]))
    columns = rerun.Points3D.columns(
        positions=places,
        colors=np.vstack([moment.colours for moment in moments]),
        radii=np.full(len(places), radius_m),
    )
    recording.send_columns("robots", times, columns.partition(sizes))
    headings = [moment.heading_rad for moment in moments if moment.heading_rad is not None]
    if headings:
        heading = np.concatenate(headings)
        fronts = _flat(1.5 * radius_m * np.column_stack([np.cos(heading), np.sin(heading)]))
        arrows = rerun.Arrows3D.columns(origins=places, vectors=fronts)
        recording.send_columns("robots/fronts", times, arrows.partition(sizes))


def _write_counts(rerun: Any, recording: Any, table: pa.Table) -> None:
    times = [rerun.TimeColumn(_TIME, duration=np.asarray(table["time_s"]))]
    for name in table.column_names:
        if name not in ("tick", "time_s"):
            values = np.asarray(table[name], dtype=np.float64)
            recording.send_columns(f"counts/{name}", times, rerun.Scalars.columns(scalars=values))


def _write_events(rerun: Any, recording: Any, run: Run) -> None:
    for event in run.events():
        recording.set_time(_TIME, duration=float(event.get("time_s", 0.0)))
        robot = event.get("robot")
        who = "" if robot is None else f"robot {robot + 1}: "
        text = str(event.get("text", event.get("kind", "")))
        recording.log("events", rerun.TextLog(f"{who}{text}"))


def _flat(points: NDArray[Any]) -> NDArray[Any]:
    """With z = 0."""
    return np.column_stack([points, np.zeros(len(points))])
