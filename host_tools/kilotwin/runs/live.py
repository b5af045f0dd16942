"""A run that is watched: what its viewer asks is answered between two calls of the engine."""

from typing import TYPE_CHECKING, Any

from kilotwin.runs.live_link import LiveLink
from kilotwin.runs.packing import for_page, pack
from kilotwin.units import seconds

if TYPE_CHECKING:
    from kilotwin._emulator import Samples, Simulation

CHUNK_S = 0.1
"""About how long a call of the engine takes then: a viewer wants ten moments a second."""
_SHOWN = ("x_m", "y_m", "heading_rad", "led")
_OBJECTS = ("object_x_m", "object_y_m", "object_heading_rad")


def packed_moment(snapshot: "Samples", zero_tick: int, **more: Any) -> bytes:
    """A snapshot of all robots and objects as a page takes it, with `more` in its head."""
    time_s = seconds(int(snapshot["tick"][0]) - zero_tick)
    columns = {name: snapshot[name][0] for name in _SHOWN}  # type: ignore[literal-required]
    if len(snapshot.get("object_x_m", ())):
        columns |= {name: snapshot[name][0] for name in _OBJECTS}  # type: ignore[literal-required]
    return pack({"time_s": time_s, **more}, for_page(columns))


class Live:
    """Answers the viewer of one run."""

    def __init__(self, descriptor: int, simulation: "Simulation") -> None:
        self._link = LiveLink(descriptor)
        self._simulation = simulation
        self._asked = False

    def heed(self, zero_tick: int) -> None:
        """Does what was asked since the last call; `zero_tick` is that of the run's begin."""
        for order in self._link.orders():
            if order.get("do") == "look":
                self._asked = True
        self._link.flush()
        if self._asked and self._link.is_free:
            self._asked = False
            self._link.send(packed_moment(self._simulation.snapshot(), zero_tick))
