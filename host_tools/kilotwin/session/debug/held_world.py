"""The world's side: a companion of the run that forks checkpoints, stands still where it is told
to, and answers from there.

Each process has a link of its own (`slot`) to the one that leads. It obeys:

    fork    another process on another link goes on from here, as a `go` says
    go      this one does
    note    from here on it says at each checkpoint which bytes of a robot may have changed
    chip    registers and memory of a robot
    hash    the run's result so far
    end     no more of it

and says `checkpoint` (may it fork one?), `stop` (a robot's instruction), `stand` (a tick), `over`.
"""

import base64
import os
import select
import time
from collections import deque
from collections.abc import Sequence
from typing import Any, NoReturn

from kilotwin._emulator import Simulation
from kilotwin.session.debug.links import GoneError, Link, Message
from kilotwin.session.loop import NEVER, Companion

NOTHING: Message = {
    "breakpoints": [],
    "watches": [],
    "step": False,
    "message": False,
    "colour": None,
    "only_notes": False,
    "until": None,
}
"""No cause to stop for robots that are held (emulator/robots/translated/debugging.h)."""


class HeldWorld(Companion):
    """The companion of a run that is led. It begins with a `stand`."""

    def __init__(self, simulation: Simulation, links: Sequence[Link]) -> None:
        self._simulation = simulation
        self._links = links
        self._slot = 0
        self._stand_at = -NEVER
        self._rush_to = -NEVER
        self._listens = self._holds = False
        self._noted_since: int | None = None  # the tick; None: nothing is noted
        self._forks_at: deque[tuple[int, float]] = deque()
        self._forked_at_s = 0.0  # CPU time of this process

    @property
    def _link(self) -> Link:
        return self._links[self._slot]

    def step(self, now: int) -> None:
        """Forks a checkpoint if one is due, and stands still if it is to."""
        while self._forks_at and self._forks_at[0][0] <= now:
            _, behind_s = self._forks_at.popleft()
            if time.process_time() - self._forked_at_s >= behind_s:
                self._fork_checkpoint(now)
        if now >= self._stand_at:
            self._stand_at = NEVER
            self._say("stand", now)
            self._obey()
        if self._listens and select.select([self._link], [], [], 0)[0]:
            self._receive()  # there is but one order for one who runs
            self._simulation.want({**NOTHING, "step": True})

    def next_due(self) -> int:
        """The next tick at which it acts. Near what is wanted the world goes step by step, so that
        no robot is ahead of another by more."""
        due = min(self._stand_at, self._forks_at[0][0] if self._forks_at else NEVER)
        now = self._simulation.tick
        return min(due, self._rush_to if now < self._rush_to else now + 1)

    def finish(self) -> None:
        """The run is over: it can be looked at, and no more."""
        self._say("over", self._simulation.tick)
        while True:
            self._obey()

    def stopped(self, stop: Message) -> None:
        """In the midst of a step, before a robot's instruction."""
        self._say("stop", self._simulation.tick, **stop)
        self._obey()

    def _say(self, what: str, tick: int, **more: Any) -> None:
        found = self._simulation.found() if self._holds else None
        self._answer({"type": what, "tick": tick, "found": found, **more})

    def _answer(self, message: Message) -> None:
        try:
            self._link.send(message)
        except GoneError:
            _end()

    def _receive(self) -> Message:
        try:
            return self._link.receive()
        except GoneError:
            _end()

    def _obey(self) -> None:
        """Carries out orders until one is to go on, in this process or in a fork of it."""
        while True:
            order = self._receive()
            match order["do"]:
                case "go":
                    self._go(order)
                    return
                case "fork":
                    if self._fork(order["slot"]):
                        self._go(order["go"])
                        return
                case "note":
                    self._simulation.note_written(order["robot"])
                    self._noted_since = self._simulation.tick
                case "chip":
                    self._answer(_readable(self._simulation.chip(order["robot"])))
                case "cycle":
                    cycle = self._simulation.own_cycle(order["robot"], order["at_s"])
                    self._answer({"cycle": cycle})
                case "tick":
                    tick = self._simulation.tick_of(order["robot"], order["cycle"])
                    self._answer({"tick": tick})
                case "hash":
                    self._answer({"hash": self._simulation.result_hash()})
                case _:
                    _end()

    def _go(self, go: Message) -> None:
        if go["hold"] is not None:
            self._simulation.hold(go["hold"], self.stopped)
            self._holds = True
        if go["wanted"] is not None:
            self._simulation.want(go["wanted"])
        self._stand_at = NEVER if go["stand_at"] is None else go["stand_at"]
        self._rush_to = NEVER if go["rush_to"] is None else go["rush_to"]
        self._forks_at = deque((tick, behind_s) for tick, behind_s in go["forks_at"])
        self._listens = go["listens"]

    def _fork_checkpoint(self, now: int) -> None:
        """Asks whether this tick is to have one. The fork stands there until it is told more."""
        written = None
        if self._noted_since is not None:
            written = [self._noted_since, now, self._simulation.take_written()]
            self._noted_since = now
        self._answer({"type": "checkpoint", "tick": now, "written": written})
        slot = self._receive()["slot"]
        is_new = slot is not None and self._fork(slot)
        self._forked_at_s = time.process_time()
        if not is_new:
            return
        self._forks_at.clear()
        self._stand_at, self._listens = NEVER, False
        self._obey()

    def _fork(self, slot: int) -> bool:
        """Whether this is the new process, which has the link `slot`. The old one says who it is,
        before the new one says a word."""
        process = os.fork()
        if process == 0:
            self._slot = slot
            return True
        self._answer({"process": process})
        return False


def _readable(chip: dict[str, Any]) -> Message:
    return {**chip, "data": base64.b64encode(chip["data"]).decode()}


def _end() -> NoReturn:
    os._exit(0)
