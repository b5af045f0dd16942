"""The buses of an emulated grid in this process, as python-can knows buses.

One `EmulatedGrid` sits on the engine; each of its `buses` is a python-can bus for tools that want
one. Who handles many frames takes them from the grid as one array.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import can
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from kilotwin._emulator import Simulation


class EmulatedGrid:
    """The host's node on each of an engine's buses."""

    def __init__(self, simulation: "Simulation", buses: int) -> None:
        """`simulation` has a grid of so many buses."""
        self._simulation = simulation
        self.buses = [EmulatedBus(self, number) for number in range(buses)]

    def send(self, bus: int, identifier: int, data: bytes) -> bool:
        """Queues a frame at the host's node; False if its queue is full."""
        return self._simulation.send_can(bus, identifier, data)

    def send_all(self, bus: int, identifiers: Sequence[int], data: bytes) -> int:
        """The same bytes to several addresses; how many the queue had room for."""
        send = self._simulation.send_can
        for count, identifier in enumerate(identifiers):
            if not send(bus, identifier, data):
                return count
        return len(identifiers)

    def take(self) -> NDArray[np.void]:
        """Every frame that ended on any bus since the last call, in order of time."""
        return self._simulation.can_frames()

    def share(self) -> None:
        """Hands each bus what came for it from the others' nodes."""
        for frame in self.take():
            if not frame["from_host"]:
                self.buses[frame["bus"]].take_over(message_of(frame))


class EmulatedBus(can.BusABC):
    """One bus. What a single bus receives is kept until it is asked for."""

    def __init__(self, grid: EmulatedGrid, number: int) -> None:
        """Bus `number` of a grid."""
        self.grid = grid
        self.number = number
        self.channel_info = f"emulated bus {number}"
        self._received: list[can.Message] = []
        super().__init__(channel=f"can{number}")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Queues a frame; CanOperationError if the node's queue is full."""
        if not self.grid.send(self.number, msg.arbitration_id, bytes(msg.data)):
            raise can.CanOperationError(f"{self.channel_info}: the queue is full")

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._received:
            self.grid.share()
        if not self._received:
            return None, False
        return self._received.pop(0), False

    def take_over(self, message: can.Message) -> None:
        """A frame that another bus's call brought."""
        self._received.append(message)


def message_of(frame: Any) -> can.Message:
    """A frame of the engine's array as python-can has it."""
    return can.Message(
        timestamp=float(frame["at_s"]),
        arbitration_id=int(frame["id"]),
        data=frame["data"][: frame["dlc"]].tobytes(),
        is_extended_id=False,
        is_rx=not frame["from_host"],
        channel=f"can{frame['bus']}",
    )
