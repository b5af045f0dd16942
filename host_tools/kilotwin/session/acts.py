"""Acts that steer a run while it goes on: their events, and their repetition."""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from kilotwin.session.loop import NEVER, Companion

STEERED = "steered"
"""The kind of an event after which the run is not what its experiment says."""
PACED = "paced"
"""The kind of one that changes how fast it goes, and nothing else."""

Act = tuple[int, dict[str, Any]]
"""An order that steers (steering.py), and the tick at which it was carried out."""


def event_of(tick: int, kind: str, text: str, order: Mapping[str, Any]) -> dict[str, Any]:
    """The event of an order: what it did, as a sentence, and its keys."""
    return {"tick": tick, "kind": kind, "text": text, **order}


def acts_of(events: Iterable[Mapping[str, Any]]) -> tuple[Act, ...]:
    """The acts in a run that was steered, by its events, which are in order of time."""
    return tuple(
        (int(event["tick"]), _order_of(event)) for event in events if event["kind"] == STEERED
    )


def _order_of(event: Mapping[str, Any]) -> dict[str, Any]:
    beside = ("time_s", "tick", "kind", "text")
    keys = {key: value for key, value in event.items() if key not in beside}
    return {"id": 0, "told": event["text"], **keys}


class Repetition(Companion):
    """Carries acts out again, each at its tick."""

    def __init__(self, acts: Iterable[Act], do: Callable[[dict[str, Any]], None]) -> None:
        """`do`: carries an order out now."""
        self._acts = deque(acts)
        self._do = do

    def step(self, now: int) -> None:
        """Does what is due. InputError if it cannot be done: then this is another run by now."""
        while self._acts and self._acts[0][0] <= now:
            self._do(self._acts.popleft()[1])

    def next_due(self) -> int:
        """The tick of the next."""
        return self._acts[0][0] if self._acts else NEVER
