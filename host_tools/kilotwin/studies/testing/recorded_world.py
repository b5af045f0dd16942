"""A World that remembers what has happened, for a run folder should its test fail."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kilotwin import _emulator
from kilotwin.programs.group import build_group
from kilotwin.runs.folder import FINISHED, close_manifest
from kilotwin.runs.writer import RunWriter
from kilotwin.session.loop import Companion
from kilotwin.session.run import new_manifest
from kilotwin.session.world import World
from kilotwin.units import seconds

if TYPE_CHECKING:
    from kilotwin._emulator import Samples, Simulation

# More samples than these are thinned out, so that a long test takes no more memory.
_MOST_SAMPLES = 4000


class Snapshots(Companion):
    """Remembers how a world was: each `every` ticks, less often the longer it goes on."""

    def __init__(self, simulation: "Simulation", every: int) -> None:
        self._simulation = simulation
        self._every = every
        self._due = 0
        self.taken: list[Samples] = []

    def step(self, now: int) -> None:
        """Takes one, if it is time to."""
        if now < self._due:
            return
        self.taken.append(self._simulation.snapshot())
        if len(self.taken) > _MOST_SAMPLES:
            self.taken = self.taken[::2]
            self._every *= 2
        self._due = (now // self._every + 1) * self._every

    def next_due(self) -> int:
        """When it takes the next."""
        return self._due

    def finish(self) -> None:
        """The last moment may be one."""
        self.step(self._simulation.tick)


class RecordedWorld(World):
    """Samples are snapshots, each `record.sample_s`: they change no result."""

    def __init__(self, experiment: str | Path | None = None, **keys: Any) -> None:
        """As World."""
        super().__init__(experiment, **keys)
        self._snapshots = Snapshots(self._simulation, self._experiment.keys.sample_ticks)
        self._snapshots.step(0)
        self._companions.append(self._snapshots)

    @property
    def seed(self) -> int:
        """The world's."""
        return self._experiment.keys.seed

    def keep(self, folder: Path) -> None:
        """Writes the run folder, up to now; OSError if it cannot be made."""
        taken, now = [*self._snapshots.taken], self._simulation.snapshot()
        if now["tick"][0] > taken[-1]["tick"][0]:
            taken.append(now)
        guests = [build_group(group) for group in self._experiment.groups]
        manifest = new_manifest(self._experiment, guests, sys.argv)
        engine = {"version": _emulator.VERSION, "build": _emulator.BUILD}
        writer = RunWriter(folder, self._experiment, {**manifest, "engine": engine})
        for samples in taken:
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
