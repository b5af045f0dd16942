"""Plays the [[step]]s of an experiment on an engine."""

from collections import deque
from typing import TYPE_CHECKING

from kilotwin import _emulator
from kilotwin.errors import RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.step import Step
from kilotwin.session.loop import NEVER, Companion
from kilotwin.units import ticks

if TYPE_CHECKING:
    from kilotwin._emulator import Simulation


class Steps(Companion):
    """Those still to come."""

    def __init__(self, experiment: Experiment, simulation: "Simulation") -> None:
        steps = experiment.keys.step
        self._due: deque[Step] = deque(sorted(steps, key=lambda step: step.at_s))
        self._robot_of = experiment.robot_of
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
                robot = self._robot_of(step.robot)
                assert robot is not None
                _place(simulation, robot, step)

    def next_due(self) -> int:
        """The tick of the next."""
        return ticks(self._due[0].at_s) if self._due else NEVER


def _place(simulation: "Simulation", robot: int, step: Step) -> None:
    try:
        simulation.place(robot, *map(float, step.pose or ()))
    except _emulator.EngineError:
        what = f"robot {step.robot} has no room there; put it elsewhere"
        raise RunError(f"a [[step]] at {step.at_s:g} s: {what}") from None
