"""An environment above emulated robots: camera and overhead controller are of the engine's world.

Pictures are taken, and the program is shown them, between two ticks; what the controller shines in
the meantime is known beforehand, since its program has nothing to say until the next picture.
"""

import math
from collections import deque
from typing import TYPE_CHECKING, Any

from kilotwin.errors import RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.environment_record import EnvironmentEvents, EnvironmentMemory
from kilotwin.session.loop import Companion
from kilotwin.table.environment.camera import EmulatedCamera
from kilotwin.table.environment.outbox import Sending
from kilotwin.table.environment.play import Play
from kilotwin.table.environment.protocol import Seen
from kilotwin.table.links.emulated_overhead import EmulatedOverhead, phase_s
from kilotwin.units import TICK_S

if TYPE_CHECKING:
    from kilotwin._emulator import Simulation


class EmulatedEnvironment(Companion):
    """Made before t = 0."""

    def __init__(self, experiment: Experiment, simulation: "Simulation") -> None:
        """InputError if the program cannot be made. keep() says who is told what happens."""
        keys = experiment.keys
        assert keys.environment is not None
        self._simulation = simulation
        self._first = EnvironmentMemory()
        self._record: EnvironmentEvents = self._first
        self.play = Play(experiment, self)
        self._camera = EmulatedCamera(keys.environment, keys.seed, experiment.uid_of)
        self._delay_s = keys.environment.delay_s
        self._step_ticks = keys.engine.step_ticks
        boxes = self.play.outboxes.boxes
        self._controllers = [EmulatedOverhead(phase_s(keys.seed, n)) for n in range(len(boxes))]
        self._pictures = 0
        self._developing: deque[tuple[int, Seen]] = deque()
        """Pictures that the program has not been shown, and the tick at which it will be."""
        self._lit_until = 0
        """All frames before this tick are the engine's."""

    def keep(self, record: EnvironmentEvents) -> None:
        """Tells `record` what happens from now on, and what the program has noted already."""
        self._record = record
        for time_s, text in self._first.notes:
            record.note(time_s, text)

    def sent(self, sending: Sending) -> None:
        """See play.Listener."""
        self._record.sent(sending)

    def note(self, time_s: float, text: str) -> None:
        """See play.Listener."""
        self._record.note(time_s, text)

    def step(self, now: int) -> None:
        """Takes a picture, or shows the program one, if it is time to; then shines until the next
        such moment."""
        now_s = now * TICK_S
        while self._camera.tick_of(self._pictures) <= now:
            seen = self._camera.picture(self._pictures, now_s, self._simulation.snapshot())
            shown = math.ceil((now_s + self._delay_s) / TICK_S - 1e-9)
            self._developing.append((shown, seen))
            self._pictures += 1
        while self._developing and self._developing[0][0] <= now:
            self._show(self._developing.popleft()[1], now_s)
        self._shine(now, self._due_tick(now))

    def _show(self, seen: Seen, now_s: float) -> None:
        """Keeps all that was sent until a mistake of the program."""
        try:
            self.play.show(seen, now_s)
        except RunError:
            self.close()
            raise

    def next_due(self) -> int:
        """The end of the world step in which something is due."""
        return self._due_tick(self._simulation.tick)

    def _due_tick(self, tick: int) -> int:
        """The end of the world step in which something is due: 1 tick or more after `tick`."""
        due = self._camera.tick_of(self._pictures)
        if self._developing:
            due = min(due, self._developing[0][0])
        steps = max(1, math.ceil((due - tick) / self._step_ticks))
        return tick + steps * self._step_ticks

    def _shine(self, now: int, until: int) -> None:
        """Hands the engine the frames up to the tick `until`."""
        begin = max(self._lit_until, now)
        if until <= begin:
            return
        begin_s, end_s, now_s = begin * TICK_S, until * TICK_S, now * TICK_S
        for number, controller in enumerate(self._controllers):
            for sending in self.play.sendings(begin_s, end_s, number):
                controller.take(sending.packet, sending.there_s)
            for at_s, frame in controller.frames(begin_s, end_s):
                self._simulation.shine(frame, at_s - now_s, number)
        self._lit_until = until

    def summary(self) -> dict[str, Any]:
        """`environment`, with `heard`: share of the controllers' frames that a robot received, over
        all robots that they fell on."""
        stats = self._simulation.stats()
        frames, reached = int(stats["frames_from_above"]), stats["reached_from_above"]
        heard = stats["received_from_above"] / reached if reached else None
        play = {
            **self.play.summary(),
            "frames": frames,
            "heard": None if heard is None else round(heard, 4),
        }
        return {"environment": play}

    def close(self) -> None:
        """Ends the files."""
        self._record.close()
