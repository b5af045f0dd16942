"""A World that remembers what has happened, for a run folder should its test fail."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kilotwin import _emulator
from kilotwin.programs.group import build_group
from kilotwin.runs.folder import FINISHED, close_manifest
from kilotwin.runs.writer import RunWriter
from kilotwin.session.run import new_manifest
from kilotwin.session.world import World
from kilotwin.units import seconds

if TYPE_CHECKING:
    from kilotwin._emulator import Samples

# More samples than these are thinned out, so that a long test takes no more memory.
_MOST_SAMPLES = 4000


class RecordedWorld(World):
    """Samples are snapshots, each `record.sample_s`: they change no result."""

    _samples: "list[Samples] | None" = None  # none while it is made

    def __init__(self, experiment: str | Path | None = None, **keys: Any) -> None:
        """As World."""
        super().__init__(experiment, **keys)
        self._every = self._experiment.keys.sample_ticks
        self._samples = [self._simulation.snapshot()]

    @property
    def seed(self) -> int:
        """The world's."""
        return self._experiment.keys.seed

    def _go_on_to(self, end: int) -> None:
        if self._samples is None:
            super()._go_on_to(end)
            return
        while self.tick < end:
            due = int(self._samples[-1]["tick"][0]) // self._every * self._every + self._every
            super()._go_on_to(min(end, due))
            if self.tick >= due:
                self._samples.append(self._simulation.snapshot())
                if len(self._samples) > _MOST_SAMPLES:
                    self._samples = self._samples[::2]
                    self._every *= 2

    def keep(self, folder: Path) -> None:
        """Writes the run folder, up to now; OSError if it cannot be made."""
        assert self._samples is not None
        now = self._simulation.snapshot()
        if now["tick"][0] > self._samples[-1]["tick"][0]:
            self._samples.append(now)
        guests = [build_group(group) for group in self._experiment.groups]
        manifest = new_manifest(self._experiment, guests, sys.argv)
        engine = {"version": _emulator.VERSION, "build": _emulator.BUILD}
        writer = RunWriter(folder, self._experiment, {**manifest, "engine": engine})
        for samples in self._samples:
            writer.add(samples)
        for event in self.events:
            writer.add_event(event)
        writer.close(clean=True)
        summary = {
            "experiment": self._experiment.keys.name,
            "seed": self.seed,
            "simulated_s": round(seconds(self.tick), 3),
            "robots": self.size,
        }
        close_manifest(folder, FINISHED, 0, summary=summary)
