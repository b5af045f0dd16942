"""Emulated overhead controllers on pseudo terminals, above the robots of a served world."""

from pathlib import Path
from typing import TYPE_CHECKING

from kilotwin.experiment.spec.overhead import DATA_BYTES, RUN
from kilotwin.session.loop import EachTick
from kilotwin.table.links.emulated_overhead import EmulatedOverhead
from kilotwin.table.ports.pseudo_terminal import PseudoTerminal
from kilotwin.units import TICK_S

if TYPE_CHECKING:
    from kilotwin._emulator import Simulation


class ServedOverhead(EachTick):
    """Packets of programs outside become light on the robots that a controller covers."""

    def __init__(
        self, simulation: "Simulation", link: Path | None, number: int = 0, later_s: float = 0.0
    ) -> None:
        """`link`: a name for the port, or none; InputError if it cannot be. `later_s`: its
        phase_s()."""
        self._simulation, self._number = simulation, number
        self._controller = EmulatedOverhead(later_s)
        self._terminal = PseudoTerminal(link, "--link-ohc")
        self.ran_at: int | None = None
        """The engine's tick at its first RUN."""

    @property
    def note(self) -> str:
        """How a host finds it, for people."""
        port = self._terminal.shown
        return f"an overhead controller is at {port}; --via ohc:{port}"

    def act(self, now: int) -> None:
        """Takes packets, and shines what begins within the next tick."""
        now_s = now * TICK_S
        while data := self._terminal.read(0):
            self._controller.take(data, now_s)
        for at_s, frame in self._controller.frames(now_s, now_s + TICK_S):
            self._simulation.shine(frame, at_s - now_s, self._number)
            if self.ran_at is None and frame[DATA_BYTES] == RUN[DATA_BYTES]:
                self.ran_at = now

    def close(self) -> None:
        """Unplugs it."""
        self._terminal.close()
