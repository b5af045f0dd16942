"""Interface between the controller and the CAN buses of a grid: frames in as one array, frames out.

Implemented by `can_links.CanLinks` for buses of python-can, and by `emulated_links.EmulatedLinks`
for an emulated grid in the same process.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FRAME = np.dtype(
    [
        ("at_s", "f8"),
        ("bus", "u1"),
        ("id", "u2"),
        ("dlc", "u1"),
        ("data", "u1", (8,)),
        ("from_host", "?"),
    ]
)
"""A frame that was on a bus; `data` is zero beyond `dlc` bytes."""

Frames = NDArray[np.void]
"""[frames] of FRAME, in order of time."""
NO_FRAMES: Frames = np.zeros(0, dtype=FRAME)


class FrameLog(Protocol):
    """Keeps what was on the buses."""

    def add(self, frames: Frames) -> None:
        """Frames in order of time, of any bus."""


class Links(Protocol):
    """All buses of a grid, numbered from 0. Times are those of the caller's clock, in seconds."""

    def __len__(self) -> int:
        """The number of buses."""

    def send(self, bus: int, identifier: int, data: bytes, now_s: float) -> bool:
        """Whether the bus took the frame; if its queue is full, send again later."""

    def send_all(self, bus: int, identifiers: Sequence[int], data: bytes, now_s: float) -> int:
        """The same bytes to several addresses in turn; how many of them the bus took."""

    def trouble(self, bus: int) -> str | None:
        """Why a bus does not work, in one line; None if it works."""

    def receive(self, now_s: float) -> Frames:
        """All frames since the last call, those that this host sent among them."""

    def close(self) -> None:
        """Releases the buses."""
