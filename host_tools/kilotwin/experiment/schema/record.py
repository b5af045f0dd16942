"""[record]: what of a run is written down, how often, and how exactly."""

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kilotwin.experiment.schema.section import MOST_ROBOTS, Section, Share
from kilotwin.units import TICK_S

RobotColumn = Literal["x_m", "y_m", "heading_rad", "led", "state", "site"]
Extra = Literal["motors", "battery", "messages", "modules", "frames"]
Columns = Annotated[list[RobotColumn], Field(max_length=6)]
Interval = Annotated[float, Field(ge=TICK_S, le=1e6)]
Index = Annotated[int, Field(ge=0, le=999_999)]

_MOST_FRAMES = 10_000_000

EXTRA_OF: dict[str, Extra] = {
    "left_duty": "motors",
    "right_duty": "motors",
    "battery": "battery",
    "sent": "messages",
    "received": "messages",
    "delivered": "messages",
}
"""Columns by what `also` calls them."""


class Record(Section):
    """How often poses, LED and states are written down, of which robots, and how exactly.

    Nothing here but sample_s changes a run's result_hash.
    """

    sample_s: Interval
    """Seconds from one sample to the next. Samples are at ends of world steps (engine.step_ticks),
    so never more frequent than these. Start and end are always recorded."""
    robots_s: Interval | None = None
    """The same for rows of `robots`: a multiple of sample_s, which counts, objects and metrics
    keep. As sample_s if left out."""
    columns: Columns | None = None
    """Columns of `robots` besides tick, time_s, robot and metrics: x_m, y_m, heading_rad, led,
    state, site; all if left out."""
    also: Annotated[list[Extra], Field(max_length=5)] | None = None
    """More columns of `robots`: motors (left_duty, right_duty, 0 to 255), battery (a reading of
    get_voltage()), messages (sent, received and delivered since the start: a robot that holds
    interrupts back loses some that reach it, so that its program gets fewer; of chips that is not
    known). Null for real robots. modules, on an emulated grid: a table `modules` with each one's
    state and error counters at each sample. frames, of emulated robots: a table `frames` with each
    frame that a robot or a cell received, by whom and from whom, which the page shows as lines."""
    robots: list[Index] | None = None
    """Indices of robots with rows in `robots`; all if left out. Counts and metrics are of all
    robots."""
    robots_count: Annotated[int, Field(ge=0, le=MOST_ROBOTS)] | None = None
    """In place of `robots`: their number, spread evenly over the indices; all if there are
    fewer."""
    robots_share: Share | None = None
    """In place of `robots`: their share, spread evenly."""
    precision_m: Annotated[float, Field(ge=1e-6, le=1)] | None = None
    """Step of positions in `robots`, rounded to the power of two below; headings are such that a
    robot's rim is as exact. If left out: as the engine has them (float32)."""
    sources: bool | None = None
    """Whether the run folder keeps what the run was made of: programs and headers, Python of
    metrics and environments, wire files, pictures; yes if left out. Without them the run can be
    repeated only where these are, and while nobody edits them."""
    can_log: bool = True
    """On a grid: whether can.log keeps every CAN frame."""
    prints_per_robot: Annotated[int, Field(ge=0)] = 100_000
    """Prints kept of a robot or module; further ones are counted."""
    prints: Annotated[int, Field(ge=0)] = 1_000_000
    """Prints kept of a run."""
    frames: Annotated[int, Field(ge=0)] | None = None
    """Rows of `frames` in a run with `also = ["frames"]`, some 30 bytes each on the disk; frames
    behind these are left out. 10 million if it is not given."""

    @property
    def robots_every(self) -> int:
        """How many samples are from one row of a robot to the next."""
        return 1 if self.robots_s is None else max(1, round(self.robots_s / self.sample_s))

    @property
    def most_frames(self) -> int:
        """Rows of `frames` that a run has at most; 0 without them."""
        if not self.has("frames"):
            return 0
        return _MOST_FRAMES if self.frames is None else self.frames

    def has(self, extra: Extra) -> bool:
        """Whether `also` names it."""
        return extra in (self.also or [])

    def has_column(self, name: str) -> bool:
        """Whether `robots` has that column."""
        if name in EXTRA_OF:
            return self.has(EXTRA_OF[name])
        return self.columns is None or name in self.columns

    def robots_of(self, size: int) -> NDArray[np.uint32] | None:
        """Indices of the robots that have rows, of so many; None for all."""
        if self.robots is not None:
            return np.array(sorted(self.robots), np.uint32)
        count = size if self.robots_count is None else min(self.robots_count, size)
        if self.robots_share is not None:
            count = round(self.robots_share * size)
        if count == size:
            return None
        return (np.arange(count, dtype=np.int64) * size // max(count, 1)).astype(np.uint32)
