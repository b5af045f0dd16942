"""Interface of a virtual environment's program: it gets no more than a lab can give.

    class Pheromone:
        def __init__(self, arena, settings): ...
        def step(self, seen, send): ...

The same program runs in the emulator and beside a real table (docs/environment.md).
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Protocol

from kilotwin import _emulator
from kilotwin.experiment.areas import area_of, contains
from kilotwin.experiment.experiment import Experiment


@dataclass(frozen=True, slots=True)
class SeenRobot:
    """A robot in a picture."""

    uid: int
    x_m: float
    """Its place; (0, 0) is the middle of the arena."""
    y_m: float
    heading_rad: float
    """Where it looks, counter-clockwise from +x."""
    led: tuple[int, int, int] | None
    """Its light, red, green, blue, 0 to 3 each; None from a tracker that does not see it."""


@dataclass(frozen=True, slots=True)
class Seen:
    """A picture: the robots that were found in it, by uid."""

    time_s: float
    """When it was taken, in seconds since the begin of the run."""
    robots: tuple[SeenRobot, ...]


class Sender(Protocol):
    """Words to robots. None is sent at once: the overhead controller takes them in turn."""

    def __call__(self, uid: int, value: int, type: int = 0) -> None:
        """A word to one robot: `value` is 0 to 1023, `type` 0 to 15, unless `word_bits` of
        [environment] says otherwise. It takes the place of one of
        this type that the robot has not been sent yet. ValueError for what does not fit."""

    def to_all(self, data: Iterable[int], type: int) -> None:
        """Up to nine bytes to all robots, before any words; `type` is 0 to 127; robots
        that look for words take one of type 0 for three of them."""


class Environment(Protocol):
    """A program of an `[environment]`."""

    def step(self, seen: Seen, send: Sender) -> None:
        """Called for each picture, in their order."""


@dataclass(frozen=True, slots=True)
class Draws:
    """Chance by key: the same arguments give the same number, in whatever order they come."""

    seed: int

    def uniform(self, robot: int, n: int) -> float:
        """The n-th number of a robot, in [0, 1). Both are 0 or more."""
        return _emulator.uniform(self.seed, "environment", robot, n)

    def normal(self, robot: int, n: int) -> float:
        """Made of the same number: mean 0, standard deviation 1."""
        return _emulator.normal(self.seed, "environment", robot, n)


@dataclass(frozen=True, slots=True)
class Arena:
    """The place, as the experiment file has it."""

    shape: str
    """As in [arena]."""
    width_m: float
    """Along x; a circle's diameter. Of a polygon: of the smallest upright rectangle about (0, 0)
    that holds it."""
    height_m: float
    """Along y, the same."""
    uids: tuple[int, ...]
    """The robots'."""
    chance: Draws
    """From the experiment's seed."""
    note: Callable[[str], None]
    """Writes a line into the run's events."""
    is_free: Callable[[float, float], bool]
    """Whether a place (x_m, y_m) is inside the arena and in no obstacle."""


def arena_of(experiment: Experiment, note: Callable[[str], None]) -> Arena:
    """The experiment's. `note` takes what the program has to say."""
    area = area_of(experiment.keys.arena)
    uids = tuple(experiment.uid_of(robot) for robot in range(experiment.size))
    obstacles = [area_of(obstacle) for obstacle in experiment.keys.obstacle]

    def is_free(x_m: float, y_m: float) -> bool:
        return contains(area, x_m, y_m) and not any(contains(it, x_m, y_m) for it in obstacles)

    return Arena(
        experiment.keys.arena.shape,
        area.width + 2 * abs(area.x),
        area.height + 2 * abs(area.y),
        uids,
        Draws(experiment.keys.seed),
        note,
        is_free,
    )


Settings = dict[str, Any]
"""[environment.settings] as it was written."""
