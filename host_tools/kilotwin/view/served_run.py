"""One run as the page gets it: what may have changed since it was asked last is read again."""

import contextlib
from typing import Any

import numpy as np
import pyarrow.compute as pc

from kilotwin.errors import InputError
from kilotwin.experiment.states import States
from kilotwin.runs.folder import RUNNING
from kilotwin.runs.reader import Run
from kilotwin.runs.samples import RunSamples
from kilotwin.view.scene import scene_of

MOST_EVENTS = 10_000
"""Events in one answer: the last ones."""
_PRINT = "print"


class ServedRun:
    """A run folder, finished or under way."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._folder = run.folder
        states = States.of(run.experiment)
        led_of_state = [int(np.argmax(states.of_led == k)) for k in range(len(states.names))]
        self.samples = RunSamples(
            run.folder, objects=bool(run.experiment.object), led_of_state=led_of_state
        )
        self.samples.refresh()

    def scene(self) -> dict[str, Any]:
        """What stands still, and which robots were recorded, if not all."""
        recorded = self.samples.robots.ids.tolist()
        everyone = recorded == list(range(self._run.robots_number))
        return {**scene_of(self._run), **self.state(), "recorded": None if everyone else recorded}

    def state(self) -> dict[str, Any]:
        """How far it is; `last_s` is the time of the last sample."""
        if self._run.manifest.get("status") == RUNNING:
            with contextlib.suppress(InputError):  # its manifest is being replaced
                self._run = Run.open(self._folder)
        number = self.samples.refresh()
        times_s = self.samples.times_s()
        return {
            "status": str(self._run.manifest.get("status", "")),
            "samples": number,
            "first_s": float(times_s[0]) if number else 0.0,
            "last_s": float(times_s[-1]) if number else 0.0,
        }

    def events(self) -> dict[str, Any]:
        """What happened, but prints, which are many: the last ones, and how many there are."""
        events = [event for event in self._run.events() if event.get("kind") != _PRINT]
        return {"number": len(events), "events": events[-MOST_EVENTS:]}

    def robot(self, robot: int) -> dict[str, Any]:
        """A robot's LED from each change on, and its events and prints. KeyError: not recorded."""
        places = {int(known): place for place, known in enumerate(self.samples.robots.ids)}
        its = [event for event in self._run.events() if event.get("robot") == robot]
        return {
            "history": self.samples.history(places[robot]),
            "number": len(its),
            "events": its[-MOST_EVENTS:],
        }

    def reports(self, time_s: float, window_s: float) -> dict[str, Any]:
        """What a grid's host had heard by then: each robot's last report, and those of late."""
        if self._run.experiment.grid is None:
            return {"robots": [], "number": 0}
        table = self._run.tracking()
        table = table.filter(pc.less_equal(table["time_s"], time_s))
        late = pc.sum(pc.greater(table["time_s"], time_s - window_s)).as_py() or 0
        last: dict[int, list[Any]] = {}
        columns = ("time_s", "robot", "x_m", "y_m", "module_x", "module_y", "cell")
        for row in zip(*(table[column].to_pylist() for column in columns), strict=True):
            last[row[1]] = list(row)
        return {"robots": list(last.values()), "number": table.num_rows, "late": late}
