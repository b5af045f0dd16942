"""Plays the [[step]]s of an experiment on an engine."""

from collections import deque
from typing import TYPE_CHECKING

from kilotwin import _emulator
from kilotwin.errors import RunError
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.step import Step
from kilotwin.session.loop import NEVER, Companion
from kilotwin.units import ticks

if TYPE_CHECKING:
    from kilotwin._emulator import Simulation


class Steps(Companion):
    """Those still to come."""

    def __init__(self, experiment: ExperimentSchema, simulation: "Simulation") -> None:
        self._due: deque[Step] = deque(sorted(experiment.step, key=lambda step: step.at_s))
        self._simulation = simulation

    def step(self, now: int) -> None:
        """Does what is due; RunError where a robot has no room."""
        simulation = self._simulation
        while self._due and ticks(self._due[0].at_s) <= now:
            step = self._due.popleft()
            if step.ambient is not None:
                simulation.set_ambient(step.ambient)
            elif step.lamp is not None and step.peak is not None:
                simulation.set_peak(step.lamp, step.peak)
            elif step.robot is not None and step.pose is not None:
                _place(simulation, step.robot, step.pose, step.at_s)

    def next_due(self) -> int:
        """The tick of the next."""
        return ticks(self._due[0].at_s) if self._due else NEVER


def _place(simulation: "Simulation", robot: int, pose: list[float], at_s: float) -> None:
    try:
        simulation.place(robot, *map(float, pose))
    except _emulator.EngineError as error:
        raise RunError(f"a [[step]] at {at_s:g} s: {error}; put it elsewhere") from None
