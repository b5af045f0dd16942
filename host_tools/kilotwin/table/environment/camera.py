"""An emulated camera above the robots: pictures with errors, robots that it misses, and a delay."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from kilotwin import _emulator
from kilotwin.experiment.colours import led_rgb
from kilotwin.experiment.schema.environment import EnvironmentTable
from kilotwin.table.environment.protocol import Seen, SeenRobot
from kilotwin.units import TICK_S

if TYPE_CHECKING:
    from kilotwin._emulator import Samples


class EmulatedCamera:
    """Sees what the engine's samples have. Without state: chance is keyed by robot and picture."""

    def __init__(self, keys: EnvironmentTable, seed: int, uid_of: Callable[[int], int]) -> None:
        """`uid_of` a robot's index: a camera that knows robots apart."""
        self._keys, self._seed, self._uid_of = keys, seed, uid_of

    def tick_of(self, number: int) -> int:
        """When picture `number` is taken, from 0: the first tick that is not too early."""
        return math.ceil(number / self._keys.picture_hz / TICK_S - 1e-9)

    def picture(self, number: int, time_s: float, samples: "Samples") -> Seen:
        """Robots that it sees in a sample of one moment."""
        robots = [
            self._sighting(robot, number, samples)
            for robot in range(samples["led"].shape[1])
            if not self._misses(robot, number)
        ]
        return Seen(time_s, tuple(sorted(robots, key=lambda robot: robot.uid)))

    def _misses(self, robot: int, number: int) -> bool:
        return _emulator.uniform(self._seed, "camera_miss", robot, number) < self._keys.missed

    def _sighting(self, robot: int, number: int, samples: "Samples") -> SeenRobot:
        def error(purpose: str, spread: float) -> float:
            return spread * _emulator.normal(self._seed, purpose, robot, number) if spread else 0.0

        return SeenRobot(
            self._uid_of(robot),
            float(samples["x_m"][0, robot]) + error("camera_x", self._keys.position_noise_m),
            float(samples["y_m"][0, robot]) + error("camera_y", self._keys.position_noise_m),
            float(samples["heading_rad"][0, robot])
            + error("camera_heading", self._keys.heading_noise_rad),
            led_rgb(int(samples["led"][0, robot])),
        )
