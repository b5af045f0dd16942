"""The page of a `World(view=True)`. What it shows is in a folder that goes with the world."""

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from kilotwin import _emulator
from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.folder import RUNNING, UIDS
from kilotwin.runs.writer import RunWriter
from kilotwin.session.attached import AttachedViewer, open_page
from kilotwin.session.live import CHUNK_S, Live
from kilotwin.session.loop import Companion
from kilotwin.session.steering import Steering
from kilotwin.units import ticks

if TYPE_CHECKING:
    from kilotwin._emulator import Simulation

# For the step "to the next sample": a world has samples when it is looked at.
_SAMPLE_S = 1.0


class WorldView(Companion):
    """Shows a world while it is stepped, and lets it be steered."""

    def __init__(
        self, experiment: Experiment, simulation: "Simulation", grid: Callable[[str], None]
    ) -> None:
        """RunError without the built page. `grid`: takes orders for the host of a grid."""
        self._simulation = simulation
        self._viewer = AttachedViewer(self._show, steers=True, framed=True)
        self._scratch = tempfile.TemporaryDirectory(prefix="kilotwin-world-")
        manifest = {
            "status": RUNNING,
            "engine": {"version": _emulator.VERSION},
            UIDS: list(experiment.uids) if experiment.lab else None,
        }
        folder = Path(self._scratch.name) / experiment.keys.name.replace("/", "-")
        self._writer = RunWriter(folder, experiment, manifest)
        steering = Steering(
            simulation, ticks(_SAMPLE_S), self._writer.add_event, grid, experiment.uid_of
        )
        has_grid = experiment.keys.grid is not None
        self._live = Live(self._viewer.run_end, simulation, steering, grid=has_grid)
        self._written_s, self._written_tick = -1.0, -1
        self.take()
        self._viewer.open(folder)

    @property
    def address(self) -> str:
        """The address of the page."""
        return self._viewer.address

    def step(self, now: int) -> None:
        """Shows how it is, if it is time to; waits a moment if its page has paused it."""
        if time.monotonic() - self._written_s >= CHUNK_S:
            self.take()
        self._live.step(now)

    def next_due(self) -> int:
        """How far the page lets it go."""
        return self._live.next_due()

    def take(self) -> None:
        """Writes down how it is."""
        if self._simulation.tick > self._written_tick:
            self._written_s, self._written_tick = time.monotonic(), self._simulation.tick
            self._writer.add(self._simulation.snapshot())

    def finish(self) -> None:
        """Shows how it is when it stands still."""
        self.take()

    def close(self) -> None:
        """Ends the viewer; its page keeps what it has."""
        self._viewer.close()
        self._writer.close(clean=False)
        self._scratch.cleanup()

    def _show(self, address: str) -> None:
        sys.stderr.write(f"view: {address}\n")
        if "ipykernel" not in sys.modules:  # a notebook has it in a cell
            open_page(address)
