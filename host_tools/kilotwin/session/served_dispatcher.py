"""An emulated dispatcher on a pseudo terminal, on all buses of a served table."""

from pathlib import Path
from typing import TYPE_CHECKING

from kilotwin.experiment.spec.grid_layout import Layout
from kilotwin.table.can.address import AddressType, to_id
from kilotwin.table.grid import frames as wire
from kilotwin.table.grid.links import Frames
from kilotwin.table.links.emulated_dispatcher import EmulatedDispatcher, ToModules
from kilotwin.table.ports.pseudo_terminal import PseudoTerminal
from kilotwin.units import TICK_S

if TYPE_CHECKING:
    from kilotwin._emulator import Simulation


class ServedDispatcher:
    """Packets of programs outside become frames on the engine's buses, and answers packets."""

    def __init__(self, simulation: "Simulation", layout: Layout, link: Path | None) -> None:
        """`link`: a name for the port, or none. InputError if it cannot be."""
        self._simulation = simulation
        self._layout = layout
        self._dispatcher = EmulatedDispatcher()
        self._terminal = PseudoTerminal(link, "--link-dispatcher")

    @property
    def note(self) -> str:
        """How a host finds it, for people."""
        port = self._terminal.shown
        return f"a dispatcher is at {port}; --can kilogrid:{port}, --via dispatcher:{port}"

    def hear(self, frames: Frames) -> None:
        """Frames that ended on the buses."""
        now_s = self._now_s
        for frame in frames[(frames["id"] & 1 == 1) & ~frames["from_host"]]:
            sender = wire.module_of_id(int(frame["id"]))
            self._dispatcher.hear(sender, frame["data"][: frame["dlc"]].tobytes(), now_s)

    def step(self, ticks: int) -> None:
        """Takes packets, and sends what is due within the next ticks."""
        while data := self._terminal.read(0):
            self._dispatcher.take(data)
        now_s = self._now_s
        frames, said = self._dispatcher.step(now_s, now_s + ticks * TICK_S)
        for at_s, frame in frames:
            self._send(frame, max(0.0, at_s - now_s))
        if said:
            self._terminal.write(said)

    def close(self) -> None:
        """Unplugs it."""
        self._terminal.close()

    def _send(self, frame: ToModules, after_s: float) -> None:
        """To the buses that modules of the address are on. A full queue is not reported."""
        address = frame.address
        for bus in range(self._layout.buses):
            one_row = address.type in (AddressType.ROW, AddressType.INDIVIDUAL)
            if not one_row or address.y in self._layout.rows_of(bus):
                self._simulation.send_can(bus, to_id(address), frame.data, after_s)

    @property
    def _now_s(self) -> float:
        return self._simulation.tick * TICK_S
