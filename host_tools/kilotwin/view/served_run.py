"""One run as the page gets it: what may have changed since it was asked last is read again."""

import contextlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from kilotwin.errors import InputError
from kilotwin.runs.columns import COUNTERS
from kilotwin.runs.event_places import uid_of
from kilotwin.runs.folder import CELLS, FRAMES, MANIFEST, PRINT, RUNNING, SENT, TRACKING
from kilotwin.runs.reader import Run
from kilotwin.runs.samples import RunSamples
from kilotwin.runs.sampling import coarseness
from kilotwin.runs.scene import PASSAGE, scene_of

MOST_EVENTS = 10_000
"""Events in one answer: the last ones."""
MOST_LINES = 200
"""The same of words and reports."""
MOST_LOGGED = 1_000
"""The same of lines of the log."""
MOST_FRAMES = 20_000
"""The same of frames between two times: the first ones."""
_MOST_VALUES = 2_000
REPORTED = ("time_s", "robot", "x_m", "y_m", "module_x", "module_y", "cell")


def _line(event: dict[str, Any]) -> str:
    """An event in small letters, as the page shows it (facts.ts)."""
    who = f"robot {uid_of(event)}: " if "robot" in event else ""
    if "module" in event:
        who = f"module {'-'.join(map(str, event['module']))}: "
    return f"{who}{event.get('kind')} {event.get('text', '')}".lower()


class ServedRun:
    """A run folder, finished or under way."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._folder = run.folder
        self._tables: dict[str, tuple[int, pa.Table]] = {}  # size of the file, and what it holds
        self._written_ns = 0
        self.samples = RunSamples.of(run)

    def scene(self) -> dict[str, Any]:
        """The scene, and which robots were recorded, if not all."""
        number = self._run.robots_number
        recorded = self.samples.robots.ids.tolist()
        if not recorded:  # the run begins
            chosen = self._run.experiment.record.robots_of(number)
            recorded = list(range(number)) if chosen is None else chosen.tolist()
        everyone = recorded == list(range(number))
        return {**scene_of(self._run), **self.state(), "recorded": None if everyone else recorded}

    def state(self) -> dict[str, Any]:
        """How far it is; `last_s` is the time of the last sample; `coarse`: a line if its samples
        are too few."""
        if self._run.manifest.get("status") == RUNNING:
            written_ns = self._manifest_ns()
            if written_ns != self._written_ns:
                with contextlib.suppress(InputError):  # its manifest is being replaced
                    self._run = Run.open(self._folder)
                    self._written_ns = written_ns
            self.samples.refresh()
        number = self.samples.samples
        times_s = self.samples.times_s()
        return {
            "status": str(self._run.manifest.get("status", "")),
            "samples": number,
            "first_s": float(times_s[0]) if number else 0.0,
            "last_s": float(times_s[-1]) if number else 0.0,
            "coarse": coarseness(self._run),
        }

    def _manifest_ns(self) -> int:
        """When its manifest was written."""
        with contextlib.suppress(OSError):
            return (self._folder / MANIFEST).stat().st_mtime_ns
        return 0

    def events(self) -> dict[str, Any]:
        """Events but prints, which are many: the last ones, and how many there are."""
        events = [event for event in self._run.events() if event.get("kind") != PRINT]
        return {"number": len(events), "events": events[-MOST_EVENTS:]}

    def log(self, words: str) -> dict[str, Any]:
        """The last events and prints in which all of the `words` are, and how many there are."""
        wanted = words.lower().split()
        found = [
            event
            for event in self._run.events()
            if not wanted or all(word in _line(event) for word in wanted)
        ]
        return {"number": len(found), "events": found[-MOST_LOGGED:]}

    def robot(self, robot: int) -> dict[str, Any]:
        """A robot's LED from each change on, its metrics, its events and prints, and the words that
        an environment told it: when (s), type, value. KeyError: not recorded."""
        places = {int(known): place for place, known in enumerate(self.samples.robots.ids)}
        its = [event for event in self._run.events() if event.get("robot") == robot]
        return {
            "history": self.samples.history(places[robot]),
            "metrics": self.samples.metrics(places[robot], _MOST_VALUES),
            "number": len(its),
            "events": its[-MOST_EVENTS:],
            "words": self._words(robot),
        }

    def _words(self, robot: int) -> list[list[Any]]:
        """The last ones."""
        if not (self._folder / f"{SENT}.arrows").exists():
            return []
        table = self._run.sent()
        its = table.filter(pc.equal(table["uid"], self._run.uid_of(robot))).to_pylist()
        return [[row[name] for name in ("time_s", "type", "value")] for row in its[-MOST_LINES:]]

    def module(self, column: int, row: int) -> dict[str, Any]:
        """A module's events, its counters from each change on, how many reports the host had from
        it, and the last ones: when (s), robot, cell, state. KeyError: there is no such module."""
        grid = self._run.experiment.grid
        if grid is None or not (0 <= column < grid.columns and 0 <= row < grid.rows):
            raise KeyError(f"module {column}-{row}")
        its = [event for event in self._run.events() if event.get("module") == [column, row]]
        table = self._tracking()
        here = pc.and_(pc.equal(table["module_x"], column), pc.equal(table["module_y"], row))
        reports = table.filter(here)
        last = reports.slice(max(0, len(reports) - MOST_LINES)).to_pylist()
        return {
            "events": its[-MOST_EVENTS:],
            "counters": self._counters(column, row),
            "number": len(reports),
            "reports": [
                [one[name] for name in ("time_s", "robot", "cell", "state")] for one in last
            ],
        }

    def _counters(self, column: int, row: int) -> list[list[Any]]:
        """When (s), and COUNTERS then; the first, and those that differ from the one before."""
        table = self._run.modules()
        here = pc.and_(pc.equal(table["x"], column), pc.equal(table["y"], row))
        rows = table.filter(here).to_pylist()
        found: list[list[Any]] = []
        for one in rows:
            values = [one[name] for name in COUNTERS]
            if not found or found[-1][1:] != values:
                found.append([one["time_s"], *values])
        return found[-MOST_LINES:]

    def reports(self, time_s: float) -> list[list[Any]]:
        """Reports that a grid's host had by then, the last of each robot: when (s), robot, x and y
        of the cell's middle (m), the module's column and row, the cell."""
        table = self._tracking()
        number = int(np.searchsorted(np.asarray(table["time_s"]), time_s, side="right"))
        robots = np.asarray(table["robot"])[:number]
        # unique() has the first of equal values: of those from behind, the last.
        _, from_behind = np.unique(robots[::-1], return_index=True)
        last = table.take(np.sort(number - 1 - from_behind)).to_pylist()
        return [[row[column] for column in REPORTED] for row in last]

    def cells(self, time_s: float) -> list[list[int]]:
        """Lights of cells of a lab's own module program at a time: the cell, colour (bits: red,
        green, blue) and brightness of each that is not dark."""
        if not (self._folder / f"{CELLS}.arrows").exists():
            return []
        table = self._table(CELLS, self._run.cells)
        number = int(np.searchsorted(np.asarray(table["time_s"]), time_s, side="right"))
        cells = np.asarray(table["cell"])[:number]
        _, from_behind = np.unique(cells[::-1], return_index=True)
        rows = table.take(number - 1 - from_behind)
        columns = [rows[name].to_pylist() for name in ("cell", "colour", "brightness")]
        return [list(row) for row in zip(*columns, strict=True) if row[1]]

    def frames(self, from_s: float, to_s: float) -> list[dict[str, Any]]:
        """Frames from robot to robot that began between two times, the first of them."""
        if not self._run.experiment.record.has("frames"):
            return []
        table = self._table(FRAMES, self._run.frames)
        begin_s = np.asarray(table["begin_s"])
        of_robots = [
            np.asarray(pc.equal(table[name].cast(pa.string()), "robot"))
            for name in ("sender_kind", "receiver_kind")
        ]
        wanted = (begin_s >= from_s) & (begin_s < to_s) & of_robots[0] & of_robots[1]
        rows = table.take(np.flatnonzero(wanted)[:MOST_FRAMES])
        columns = [rows[name].to_pylist() for name in ("begin_s", "end_s", "sender", "receiver")]
        return [dict(zip(PASSAGE, row, strict=True)) for row in zip(*columns, strict=True)]

    def _tracking(self) -> pa.Table:
        """All reports."""
        return self._table(TRACKING, self._run.tracking)

    def _table(self, name: str, read: Callable[[], pa.Table]) -> pa.Table:
        """A table of the run; read again when there is more of it."""
        file = self._folder / f"{name}.arrows"
        size = file.stat().st_size if file.exists() else 0
        if name not in self._tables or self._tables[name][0] != size:
            self._tables[name] = (size, read())
        return self._tables[name][1]
