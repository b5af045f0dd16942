"""Robots as a tracker saw them last, as samples of a run."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from kilotwin.experiment.areas import area_of, contains
from kilotwin.experiment.colours import led_byte
from kilotwin.experiment.experiment import Experiment
from kilotwin.table.environment.protocol import SeenRobot

if TYPE_CHECKING:
    from kilotwin._emulator import Samples


class SeenRobots:
    """The robots of an experiment by uid; NaN until they are seen."""

    def __init__(self, experiment: Experiment) -> None:
        robots = experiment.size
        self._index = {experiment.uid_of(robot): robot for robot in range(robots)}
        self._sites = [
            (number, area_of(site))
            for number, site in enumerate(experiment.keys.site, 1)
            if site.shape != "picture"
        ]
        self._floor = experiment.floor
        self._pose = np.full((3, robots), np.nan, dtype=np.float32)
        self._led = np.zeros(robots, dtype=np.uint8)
        self._site = np.zeros(robots, dtype=np.uint8)
        self.strangers = 0
        """Sightings of robots that are not in the experiment."""

    def take(self, robots: Iterable[SeenRobot]) -> tuple[SeenRobot, ...]:
        """Takes sightings in; those that are robots of the experiment."""
        known = []
        for robot in robots:
            index = self._index.get(robot.uid)
            if index is None:
                self.strangers += 1
                continue
            known.append(robot)
            self._pose[:, index] = robot.x_m, robot.y_m, robot.heading_rad
            self._site[index] = self._site_at(robot.x_m, robot.y_m)
            if robot.led is not None:
                self._led[index] = led_byte(*robot.led)
        return tuple(known)

    @property
    def never_seen(self) -> list[int]:
        """Uids, ascending."""
        return sorted(uid for uid, index in self._index.items() if np.isnan(self._pose[0, index]))

    def sample(self, tick: int) -> "Samples":
        """Samples as the engine makes them."""
        x, y, heading = self._pose
        return {
            "tick": np.array([tick], dtype=np.int64),
            "x_m": x[None].copy(),
            "y_m": y[None].copy(),
            "heading_rad": heading[None].copy(),
            "led": self._led[None].copy(),
            "site": self._site[None].copy(),
        }

    def _site_at(self, x: float, y: float) -> int:
        """The number of the site there, from 1; 0 for none."""
        found = (number for number, site in self._sites if contains(site, x, y))
        drawn = 0 if self._floor is None else int(self._floor.at(np.array(x), np.array(y)))
        return next(found, drawn)
