"""The buses of an emulated grid in this process: whole arrays of frames, no message per frame."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from kilotwin.table.grid.links import FrameLog, Frames
from kilotwin.units import TICK_S

if TYPE_CHECKING:
    from kilotwin._emulator import Simulation


class EmulatedLinks:
    """The host's node on each of an engine's buses."""

    def __init__(self, simulation: "Simulation", buses: int, log: FrameLog | None = None) -> None:
        """`simulation` has a grid of so many buses."""
        self._simulation = simulation
        self._buses = buses
        self._log = log

    def __len__(self) -> int:
        return self._buses

    def send(self, bus: int, identifier: int, data: bytes, now_s: float) -> bool:
        """Queues a frame at the host's node; False if its queue is full.

        The host's clock may be ahead of the engine's ticks: it is sent when that comes to `now_s`.
        """
        after_s = max(0.0, now_s - self._simulation.tick * TICK_S)
        return self._simulation.send_can(bus, identifier, data, after_s)

    def send_all(self, bus: int, identifiers: Sequence[int], data: bytes, now_s: float) -> int:
        """The same bytes to several addresses; how many the queue had room for."""
        send = self._simulation.send_can
        for count, identifier in enumerate(identifiers):
            if not send(bus, identifier, data):
                return count
        return len(identifiers)

    def trouble(self, bus: int) -> str | None:
        """None: an emulated bus works as long as the engine does."""
        return None

    def receive(self, now_s: float) -> Frames:
        """Every frame that ended on any bus since the last call, in order of time."""
        frames = self._simulation.can_frames()
        if self._log is not None and len(frames):
            self._log.add(frames)
        return frames

    def close(self) -> None:
        """Nothing to release."""
