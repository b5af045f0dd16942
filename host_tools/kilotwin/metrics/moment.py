"""The rest of an emulated run's state, beside its samples, while it stands still."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Engine(Protocol):
    """The part of the engine that is looked at."""

    def cells(self) -> NDArray[np.uint8]:
        """Lights of a grid's cells."""

    def stats(self) -> dict[str, int | float]:
        """Counts."""

    def state(self, robot: int) -> bytes:
        """A robot's variables."""


@dataclass(frozen=True)
class Moment:
    """The present moment of an engine."""

    engine: Engine
    failed: int
    """How many robots' programs do not run any more."""
    has_grid: bool

    @property
    def cells(self) -> NDArray[np.uint8] | None:
        """Lights of a grid's cells, if there is one."""
        return self.engine.cells() if self.has_grid else None

    @property
    def messages_sent(self) -> int:
        """By all robots, so far."""
        return int(self.engine.stats()["frames_sent"])
