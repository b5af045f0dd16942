"""An emulated camera above a served world: pictures go out as a tracker's would, by UDP."""

from typing import TYPE_CHECKING

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.environment import EnvironmentTable
from kilotwin.session.loop import Companion
from kilotwin.table.environment.camera import EmulatedCamera
from kilotwin.table.environment.poses import Address, PoseSender, write_lines
from kilotwin.units import TICK_S

if TYPE_CHECKING:
    from kilotwin._emulator import Simulation

_NO_PROGRAM = EnvironmentTable(program="none:none")
"""The camera as it is by default, for experiments without an [environment]."""


class ServedCamera(Companion):
    """Takes a picture when one is due, and sends it as soon as the tracker would have it."""

    def __init__(self, simulation: "Simulation", experiment: Experiment, to: Address) -> None:
        """InputError if the address is none."""
        keys = experiment.keys.environment or _NO_PROGRAM
        self._simulation = simulation
        self._camera = EmulatedCamera(keys, experiment.keys.seed, experiment.uid_of)
        self._delay_ticks = round(keys.delay_s / TICK_S)
        self._sender = PoseSender(to)
        self._shown = f"udp:{to[0]}:{to[1]}"
        self._number = 0
        self._developing: list[tuple[int, bytes]] = []

    @property
    def note(self) -> str:
        """Where its pictures go, for people."""
        return f"a camera sends robots' poses to {self._shown}; --poses {self._shown}"

    def step(self, now: int) -> None:
        """Takes a picture, or sends one, if it is time to."""
        while self._camera.tick_of(self._number) <= now:
            seen = self._camera.picture(self._number, now * TICK_S, self._simulation.snapshot())
            self._number += 1
            self._developing += [
                (now + self._delay_ticks, line) for line in write_lines(seen.robots)
            ]
        while self._developing and self._developing[0][0] <= now:
            self._sender.send(self._developing.pop(0)[1])

    def next_due(self) -> int:
        """When the next picture is taken or sent."""
        taken = self._camera.tick_of(self._number)
        return min(taken, self._developing[0][0]) if self._developing else taken

    def close(self) -> None:
        """Ends it."""
        self._sender.close()
