"""Plays the [[step]]s of an experiment on an engine."""

from collections import deque
from typing import TYPE_CHECKING

from kilotwin import _emulator
from kilotwin.errors import RunError
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.step import Step
from kilotwin.units import ticks

if TYPE_CHECKING:
    from kilotwin._emulator import Simulation


class Steps:
    """Those still to come; step() and the engine's advance() take turns."""

    def __init__(self, experiment: ExperimentSchema) -> None:
        self._due: deque[Step] = deque(sorted(experiment.step, key=lambda step: step.at_s))

    def step(self, simulation: "Simulation") -> None:
        """Does what is due at the engine's time; RunError where a robot has no room."""
        while self._due and ticks(self._due[0].at_s) <= simulation.tick:
            step = self._due.popleft()
            if step.ambient is not None:
                simulation.set_ambient(step.ambient)
            elif step.lamp is not None and step.peak is not None:
                simulation.set_peak(step.lamp, step.peak)
            elif step.robot is not None and step.pose is not None:
                _place(simulation, step.robot, step.pose, step.at_s)

    def most_ticks(self, simulation: "Simulation", wanted: int) -> int:
        """So many ticks of those wanted may the engine advance until the next is due."""
        if not self._due:
            return wanted
        return min(wanted, max(1, ticks(self._due[0].at_s) - simulation.tick))


def _place(simulation: "Simulation", robot: int, pose: list[float], at_s: float) -> None:
    try:
        simulation.place(robot, *map(float, pose))
    except _emulator.EngineError as error:
        raise RunError(f"a [[step]] at {at_s:g} s: {error}; put it elsewhere") from None
