"""An environment at work: its program is shown pictures, and what it wants told goes out in turn.

The same for an emulated table and a real one; pictures, clock and controller are its user's.
"""

from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np

from kilotwin.experiment.areas import area_of
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.ark import Layout
from kilotwin.table.environment.outbox import Outbox, Outboxes, Sending
from kilotwin.table.environment.program import EnvironmentProgram
from kilotwin.table.environment.protocol import Seen, arena_of

# hardware.md 1.6: a robot has a frame when it ends.
_FRAME_S = 130 * 33.625e-6


class Listener(Protocol):
    """Keeper of all that happens."""

    def sent(self, sending: Sending) -> None:
        """A packet has gone out."""

    def note(self, time_s: float, text: str) -> None:
        """The program has something to say."""


class Play:
    """One environment of one run. Times are the run's, in seconds since its begin."""

    def __init__(self, experiment: Experiment, listener: Listener) -> None:
        """InputError if the program cannot be made, or robots cannot be told."""
        keys, named = experiment.keys.environment, experiment.environment
        assert keys is not None
        assert named is not None
        arena = arena_of(experiment, lambda text: listener.note(self.outboxes.now_s, text))
        layout = Layout(*keys.word_bits)
        far = next((uid for uid in arena.uids if uid > layout.most_uid), None)
        if far is not None:
            what = f"words reach uids 0 to {layout.most_uid}; one robot has {far}"
            raise experiment.error(("environment",), what)
        self._listener = listener
        self._latencies: list[float] = []
        self._packets = 0
        self.pictures = 0
        areas = [area_of(one) for one in experiment.keys.overhead]
        boxes = [Outbox(keys.message_s, arena.uids, layout) for _ in areas or "1"]
        self.outboxes = Outboxes(boxes, areas)
        self.program = EnvironmentProgram(named.file, named.name, arena, keys.settings)

    def show(self, seen: Seen, now_s: float) -> None:
        """Shows the program a picture, at `now_s`; RunError names the line that failed."""
        self.outboxes.see(seen, now_s)
        self.pictures += 1
        self.program.step(seen, self.outboxes)

    def sendings(self, begin_s: float, end_s: float, controller: int = 0) -> Iterator[Sending]:
        """The packets of a controller that begin in [begin_s, end_s), where the last call ended,
        each kept."""
        for sending in self.outboxes.boxes[controller].sendings(begin_s, end_s):
            self._packets += 1
            self._latencies += [
                sending.there_s + _FRAME_S - wanted.asked_s for wanted in sending.told
            ]
            self._listener.sent(sending)
            yield sending

    def summary(self) -> dict[str, Any]:
        """The `environment` part of a run's summary.

        `latency_s`: from a wish of the program until a robot that loses nothing has heard it.
        """
        return {
            "pictures": self.pictures,
            "asked": self.outboxes.asked,
            "sent": len(self._latencies),
            "replaced": self.outboxes.replaced,
            "waiting": self.outboxes.waiting,
            "uncovered": self.outboxes.uncovered,
            "packets": self._packets,
            "latency_s": _spread(self._latencies),
        }


def _spread(values: list[float]) -> dict[str, float] | None:
    """Mean, 95th percentile and the worst; None without any."""
    if not values:
        return None
    array = np.array(values)
    return {
        "mean": round(float(array.mean()), 3),
        "p95": round(float(np.percentile(array, 95)), 3),
        "worst": round(float(array.max()), 3),
    }
