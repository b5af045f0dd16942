"""Leads the worlds of a run that is repeated: one stands at the present, the others at checkpoints.

A place is an instruction of a robot: its index, and its own cycles since power-up, of which no two
instructions have the same. To go back to a place, the last checkpoint before it is forked and runs
up to it; to find where something happened last, one checkpoint after the other, from the present
back, is forked and runs up to the next, and notes. Left out are those up to whose next one nothing
that is watched can have changed: that is noted of the robot that is held first.
"""

import base64
import contextlib
import os
import select
import signal
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from kilotwin.errors import RunError
from kilotwin.session.black_box import LOOK_S, BlackBox, Watch
from kilotwin.session.debug.checkpoints import (
    MOST,
    MOST_BYTES,
    Checkpoint,
    Written,
    latest,
    least_needed,
    on_the_way,
)
from kilotwin.session.debug.held_world import NOTHING
from kilotwin.session.debug.links import GONE, GoneError, Link, Message, pairs
from kilotwin.session.debug.world_process import Held, start
from kilotwin.session.job import Job
from kilotwin.units import ticks

# Links for checkpoints, for the present, and for a world that looks for something.
_MOST_AT_ONCE = 4
_LINKS = MOST + _MOST_AT_ONCE + 3
_EVERY_S = 10.0
"""From checkpoint to checkpoint when a run is repeated; more in a long one."""
FAR_S, NEAR_S = 0.3, 0.03
"""CPU time that lies between two checkpoints far from the present, and near it: to fork one, and to
go on with memory that is shared then, takes some 10 ms."""
_LONGEST_LOG = 1 << 16
_ASK_S = 0.05
_LONGEST_STEP = 4  # ticks of a world step
_END_S = 10.0


@dataclass(frozen=True)
class Place:
    """An instruction of a robot: its index, and its own cycle since power-up."""

    robot: int
    cycle: int


@dataclass(frozen=True)
class Wanted:
    """Causes for which the run is to stop, beside the next instruction if it is only to step.
    `watches`: addresses in data space, and bytes. `colour`: an LED byte that the LED becomes."""

    breakpoints: frozenset[int] = frozenset()
    watches: tuple[tuple[int, int], ...] = ()
    message: bool = False
    colour: int | None = None


@dataclass(frozen=True)
class Chip:
    """A robot's chip: data space with its registers, status register, program counter in bytes; and
    the moment, in seconds since t = 0."""

    data: bytes
    status: int
    pc: int
    cycle: int
    at_s: float


@dataclass(frozen=True)
class Stop:
    """Where all stands still. `why`: step, place, breakpoint, watch, message, colour, crash, begin
    or end (of what there is of the run). `watch`: which one. `before`: the cycle of the robot's
    instruction before, where it is known; or -1."""

    place: Place
    tick: int
    why: str
    watch: int = 0
    before: int = -1


@dataclass
class _World:
    """A process that runs or stands."""

    slot: int
    process: int


@dataclass
class Travel:
    """A repeated run in which one can go to and fro. A context, left with all processes ended.

    `robots`: those that are held. Use `start()` first.
    """

    job: Job
    held: Sequence[Held]
    robots: list[int] = field(default_factory=list)
    checkpoints: list[Checkpoint] = field(default_factory=list)
    interrupted: Callable[[], bool] = lambda: False
    """Whether the user wants the run to stop; asked while it runs."""

    def __enter__(self) -> "Travel":
        self._stack = contextlib.ExitStack()
        self._log = self._stack.enter_context(tempfile.TemporaryFile("w+", errors="replace"))
        self._links: list[Link] = []
        self._free: list[int] = []
        self._present: _World | None = None
        self.now: Stop | None = None
        assert self.job.black_box is not None
        self._watch = Watch(BlackBox(Path(self.job.black_box)))
        self._processes: set[int] = set()
        self._bytes: dict[int, int] = {}
        self._child = 0
        self._cores = min(_MOST_AT_ONCE, len(os.sched_getaffinity(0)))
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._processes:
            _kill(process)
        if self._child:
            os.waitpid(self._child, 0)
        for link in self._links:
            link.close()
        self._stack.close()

    # Beginning.

    def start(self, robots: Sequence[int], at_s: float) -> Stop:
        """Repeats the run up to the moment `at_s` of the first of the robots, which it holds there;
        or to the end of the run."""
        both = pairs(_LINKS)
        self._links = [ours for ours, _ in both]
        self._free = list(range(1, _LINKS))
        self._child = start(self.job, self.held, both, self._log)
        self._processes.add(self._child)
        self._present = _World(0, self._child)
        begin = self._await(self._present)["tick"]
        self.robots = list(robots)
        duration = ticks(self.job.experiment.keys.duration_s)
        self._every = max(ticks(_EVERY_S), duration // MOST)
        robot = self.robots[0]
        self._written = Written(robot, begin)
        self._links[self._present.slot].send({"do": "note", "robot": robot})
        cycle = self._ask(self._present, do="cycle", robot=robot, at_s=at_s)["cycle"]
        place = Place(robot, cycle)
        end = ticks(at_s)
        last = max(begin, end - 2 * _LONGEST_STEP)
        near = (at for at in on_the_way(max(begin, 0), end) if at < last)
        forks = _forks(range(0, last, self._every), near, [begin, last])
        self.now = Stop(place, begin, "begin")
        # Up to there it goes at full speed: no robot is held yet.
        self._go(self._present, stand_at=last, forks_at=forks)
        if self._await(self._present)["type"] == "over":
            return self._at_end()
        self._go(self._present, **self._up_to(place, self._tick_of(place)))
        return self._stopped(self._await(self._present))

    # Going on.

    def go_on(self, wanted: Wanted, *, step: bool = False) -> Stop:
        """From the present to what is wanted, to the next instruction, or to the end of the run."""
        assert self.now is not None
        assert self._present is not None
        if self.now.why == "end":
            return self.now
        begin = (self.now.tick // self._every + 1) * self._every
        end = ticks(self.job.experiment.keys.duration_s)
        due = [] if step else _forks(range(begin, end, self._every))
        self._go(
            self._present,
            wanted=_order(wanted, step=step),
            rush_to=-_FAR,
            forks_at=due,
            listens=not step,
        )
        stop = self._stopped(self._await(self._present, asks=not step))
        return stop if step else self._set(replace(stop, before=-1))

    # Going back.

    def go_back(self, wanted: Wanted, *, step: bool = False) -> Stop:
        """To the last place before now at which something that is wanted happened; of a change, to
        the instruction that made it. To the begin if there is none."""
        assert self.now is not None
        now = self.now
        if step:
            if now.before < 0:
                now = self.go_to(now.place)
            if now.why == "begin" or now.before <= 0:
                return self._at_begin()
            stop = self.go_to(Place(now.place.robot, now.before))
            return self._set(replace(stop, why="step"))
        found = self._found_before(now, wanted)
        if found is None:
            return self._at_begin()
        stop = self.go_to(Place(found["robot"], found["cycle"]))
        return self._set(replace(stop, why=found["why"], watch=found["watch"]))

    def _found_before(self, now: Stop, wanted: Wanted) -> Message | None:
        """Looks from the present back, from checkpoint to checkpoint, on all cores at once."""
        at_end = now.why == "end"
        tick = now.tick if at_end else self._tick_of(now.place)
        before = [one for one in self.checkpoints if one.tick < tick]
        # Where several are held it goes step by step, so that what was last was so in all of them.
        rush_to = _FAR if len(self.robots) == 1 else -_FAR
        ends = [*(one.tick for one in before[1:]), tick]
        looks = [
            (one, end)
            for one, end in zip(before, ends, strict=True)
            if self._may_be_in(wanted, one.tick, end)
        ]
        looks.reverse()
        worlds: deque[_World] = deque()
        found: Message | None = None
        while found is None and (looks or worlds):
            while looks and len(worlds) < self._cores:
                checkpoint, end = looks.pop(0)
                is_last = end == tick and not at_end
                worlds.append(
                    self._fork(
                        checkpoint,
                        hold=self.robots,
                        wanted=_order(
                            wanted, only_notes=True, until=now.place if is_last else None
                        ),
                        stand_at=None if is_last else end,
                        rush_to=rush_to,
                    )
                )
            world = worlds.popleft()
            found = self._await(world)["found"]
            self._end(world)
        for world in worlds:
            self._end(world)
        return found

    def _may_be_in(self, wanted: Wanted, begin: int, end: int) -> bool:
        """Whether what is wanted may have happened between two ticks."""
        beside = wanted.breakpoints or wanted.message or wanted.colour is not None
        if beside or self.robots != [self._written.robot]:
            return True
        return any(self._written.may_be_in(begin, end, *one) for one in wanted.watches)

    def go_to(self, place: Place) -> Stop:
        """To an instruction, or the first one of that robot behind it."""
        tick = self._tick_of(place)
        checkpoint = latest(self.checkpoints, tick - 1)
        if checkpoint is None:
            return self._at_begin()
        return self._from(checkpoint, place, tick)

    def go_to_moment(self, robot: int, at_s: float) -> Stop:
        """To the first instruction of a robot at or behind a moment, seconds since t = 0."""
        assert self._present is not None
        cycle = self._ask(self._present, do="cycle", robot=robot, at_s=at_s)["cycle"]
        return self.go_to(Place(robot, cycle))

    def _from(self, checkpoint: Checkpoint, place: Place, tick: int) -> Stop:
        """From a checkpoint to a place, in that tick."""
        far = range(checkpoint.tick + self._every, tick - self._every, self._every)
        forks = _forks(far, on_the_way(checkpoint.tick, tick - 1))
        world = self._fork(checkpoint, **self._up_to(place, tick), forks_at=forks)
        reply = self._await(world)
        if self._present is not None:
            self._end(self._present)
        self._present = world
        return self._stopped(reply)

    def _up_to(self, place: Place, tick: int) -> Message:
        return {
            "hold": self.robots,
            "wanted": {**NOTHING, "until": [place.robot, place.cycle]},
            "rush_to": tick - _LONGEST_STEP,
        }

    def _at_begin(self) -> Stop:
        """At the first instruction of the robot that there is a checkpoint before."""
        assert self.now is not None
        robot = self.now.place.robot
        first = self.checkpoints[0]
        return self._set(replace(self._from(first, Place(robot, 0), first.tick + 1), why="begin"))

    def _set(self, stop: Stop) -> Stop:
        self.now = stop
        return stop

    def _at_end(self) -> Stop:
        assert self.now is not None
        place, tick = self.now.place, self.now.tick
        over = max(tick, ticks(self.job.experiment.keys.duration_s))
        return self._set(Stop(place, over, "end"))

    # Looking.

    def chip(self, robot: int) -> Chip:
        """A robot's chip as it stands now."""
        assert self._present is not None
        chip = self._ask(self._present, do="chip", robot=robot)
        return Chip(
            base64.b64decode(chip["data"]), chip["status"], chip["pc"], chip["cycle"], chip["at_s"]
        )

    def result_hash(self) -> str:
        """The run's result hash as of now: of a run that is over, that of its manifest."""
        assert self._present is not None
        return str(self._ask(self._present, do="hash")["hash"])

    def bytes_kept(self) -> int:
        """Memory that the checkpoints have of their own."""
        return sum(self._bytes.values())

    # Worlds.

    def _stopped(self, reply: Message) -> Stop:
        if reply["type"] == "over":
            return self._at_end()
        if reply["type"] == "stand":
            raise RunError("a world stands where none was to; this is a mistake of Kilotwin")
        place = Place(reply["robot"], reply["cycle"])
        return self._set(Stop(place, reply["tick"], reply["why"], reply["watch"], reply["before"]))

    def _tick_of(self, place: Place) -> int:
        assert self._present is not None
        return int(
            self._ask(self._present, do="tick", robot=place.robot, cycle=place.cycle)["tick"]
        )

    def _go(self, world: _World, **order: Any) -> None:
        self._links[world.slot].send({"do": "go", **_ORDER, **order})

    def _ask(self, world: _World, **order: Any) -> Message:
        self._links[world.slot].send(order)
        return self._receive(world)

    def _fork(self, checkpoint: Checkpoint, **order: Any) -> _World:
        """A world that goes on from where the checkpoint stands."""
        slot = self._slot()
        process = self._ask(
            _World(checkpoint.slot, checkpoint.process),
            do="fork",
            slot=slot,
            go={**_ORDER, **order},
        )["process"]
        self._processes.add(process)
        return _World(slot, process)

    def _slot(self) -> int:
        slot = self._free.pop()
        self._links[slot].forget()
        return slot

    def _end(self, world: _World) -> None:
        """Ends it, and waits until it can say nothing more."""
        _kill(world.process)
        self._processes.discard(world.process)
        self._bytes.pop(world.process, None)
        self._free.append(world.slot)

    def _make_room(self, now: int) -> bool:
        """Whether there may be one more checkpoint; one that is needed least goes for it."""
        full = len(self.checkpoints) >= MOST or self.bytes_kept() > MOST_BYTES
        if full and len(self.checkpoints) < 3:
            return False
        if full:
            gone = self.checkpoints.pop(least_needed([one.tick for one in self.checkpoints], now))
            self._end(_World(gone.slot, gone.process))
        return True

    def _await(self, world: _World, *, asks: bool = False) -> Message:
        """Its message when it stands; checkpoints that it makes on the way are taken in. `asks`:
        whether it is to stand before, each moment."""
        while True:
            message = self._receive(world, asks=asks)
            if message["type"] == "checkpoint":
                if message["written"] is not None:
                    self._written.add(*message["written"])
                self._take_checkpoint(world, message["tick"])
            elif message["type"] == "error":
                raise RunError(message["message"])
            else:
                return message

    def _receive(self, world: _World, *, asks: bool = False) -> Message:
        link = self._links[world.slot]
        looks_at = time.monotonic() + LOOK_S
        while not link.waits() and not select.select([link], [], [], _ASK_S if asks else LOOK_S)[0]:
            if asks and self.interrupted():
                asks = False
                link.send({"do": "halt"})
            if time.monotonic() < looks_at:
                continue
            looks_at += LOOK_S
            if _is_gone(world.process):
                raise RunError(f"{GONE}{self._last_words()}")
            if self._watch.is_stuck():
                raise RunError(self._watch.what(self.job.experiment))
        self._watch.heard()
        try:
            return link.receive()
        except GoneError as error:
            raise RunError(f"{error}{self._last_words()}") from None

    def _last_words(self) -> str:
        self._log.seek(0)
        lines = self._log.read(_LONGEST_LOG).strip().splitlines()
        return f": {lines[-1]}" if lines else ""

    def _take_checkpoint(self, world: _World, tick: int) -> None:
        link = self._links[world.slot]
        for one in self.checkpoints[-1:]:
            self._bytes[one.process] = _own_bytes(one.process)
        near = any(one.tick == tick for one in self.checkpoints)
        if near or not self._make_room(tick):
            link.send({"slot": None})
            return
        slot = self._slot()
        link.send({"slot": slot})
        process = self._receive(world)["process"]
        self._processes.add(process)
        self.checkpoints.append(Checkpoint(tick, slot, process))
        self.checkpoints.sort(key=lambda one: one.tick)


_FAR = 1 << 60
_ORDER: Message = {
    "hold": None,
    "wanted": None,
    "stand_at": None,
    "rush_to": None,
    "forks_at": [],
    "listens": False,
}


def _forks(
    far: Iterable[int], near: Iterable[int] = (), here: Iterable[int] = ()
) -> list[tuple[int, float]]:
    """Ticks at which a world forks checkpoints, and how much CPU time behind the last one each has
    to be."""
    behind_s = {
        **dict.fromkeys(far, FAR_S),
        **dict.fromkeys(near, NEAR_S),
        **dict.fromkeys(here, 0.0),
    }
    return sorted(behind_s.items())


def _order(
    wanted: Wanted,
    *,
    step: bool = False,
    only_notes: bool = False,
    until: Place | None = None,
) -> Message:
    return {
        **NOTHING,
        "breakpoints": sorted(wanted.breakpoints),
        "watches": [list(one) for one in wanted.watches],
        "message": wanted.message,
        "colour": wanted.colour,
        "step": step,
        "only_notes": only_notes,
        "until": None if until is None else [until.robot, until.cycle],
    }


def _kill(process: int) -> None:
    """Ends a process, if it is there, and waits for that."""
    with contextlib.suppress(OSError):
        handle = os.pidfd_open(process)
        try:
            signal.pidfd_send_signal(handle, signal.SIGKILL)
            select.select([handle], [], [], _END_S)
        finally:
            os.close(handle)


def _is_gone(process: int) -> bool:
    """Whether it has ended, be it that its status was not read yet."""
    with contextlib.suppress(OSError, IndexError):
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"
    return True


def _own_bytes(process: int) -> int:
    """Memory that no other process shares, 0 if it is gone."""
    with contextlib.suppress(OSError, ValueError, IndexError):
        for line in Path(f"/proc/{process}/smaps_rollup").read_text().splitlines():
            if line.startswith("Private_Dirty:"):
                return int(line.split()[1]) * 1024
    return 0
