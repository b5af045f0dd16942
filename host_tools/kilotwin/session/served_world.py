"""A world that waits for hosts outside: `kilotwin serve world EXP.toml`.

Robots have an overhead controller above them, and a table below them its CAN buses. The engine
keeps pace with the wall, or goes `speed` times as fast. Time 0 of the run folder is the host's
first RUN; without a grid and with [[command]] it is when the robots were switched on.
"""

import contextlib
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.columns import chosen_of
from kilotwin.runs.event_places import EventPlaces
from kilotwin.runs.writer import RunWriter
from kilotwin.session.emulated import EmulatedWorld
from kilotwin.session.job import Serving
from kilotwin.session.loop import NEVER, Companion
from kilotwin.session.served_camera import ServedCamera
from kilotwin.session.served_grid import ServedTable
from kilotwin.session.served_overhead import ServedOverhead
from kilotwin.table.links.emulated_overhead import phase_s
from kilotwin.units import seconds, ticks

if TYPE_CHECKING:
    from kilotwin._emulator import Samples, Simulation


@dataclass(frozen=True)
class Begin:
    """How a served run begins and ends. `zero_tick`: the engine's tick when it began, None before
    that; `over`: whether there is nothing more to wait for; `see`: corrects sites in samples."""

    zero_tick: Callable[[], int | None]
    over: Callable[[], bool]
    see: Callable[["Samples"], None] = lambda _: None


class ServedWorld(EmulatedWorld):
    """The engine in the pace of the wall, a tick at a time."""

    def __init__(
        self,
        simulation: "Simulation",
        places: EventPlaces,
        duration: int,
        begin: Begin,
        speed: float,
    ) -> None:
        """`duration` of the run, in ticks."""
        super().__init__(simulation, places)
        self._duration = duration
        self._begin = begin
        self._speed = speed
        self._begin_tick = simulation.tick
        self._began = time.monotonic()

    @property
    def zero_tick(self) -> int:  # type: ignore[override]
        """The engine's tick when the run began; 0 before that."""
        return self._begin.zero_tick() or 0

    @property
    def ran(self) -> bool:
        """Whether the whole run is over."""
        zero = self._begin.zero_tick()
        return zero is not None and self.tick - zero >= self._duration

    @property
    def over(self) -> bool:
        """Whether the host has had its run, and is quiet."""
        return self._begin.over()

    def advance(self, to: int) -> None:
        """Goes on by a tick, and waits until the wall has come to where the engine is."""
        self.simulation.advance(1)
        if math.isinf(self._speed):
            return
        simulated_s = seconds(self.tick - self._begin_tick)
        ahead_s = simulated_s / self._speed - (time.monotonic() - self._began)
        if ahead_s > 0:
            time.sleep(ahead_s)

    def samples(self) -> "Samples":
        """Those of the run since the last call, their times since its begin."""
        return self._of_the_run(self.simulation.samples())

    def last_moment(self) -> "Samples":
        """The present one, if the run still goes on."""
        return self._of_the_run(self.simulation.snapshot())

    def _of_the_run(self, samples: "Samples") -> "Samples":
        begun = self._begin.zero_tick()
        zero = NEVER if begun is None else begun
        kept = (samples["tick"] >= zero) & (samples["tick"] <= zero + self._duration)
        cut = chosen_of(samples, kept)
        cut["tick"] -= zero
        self._begin.see(cut)
        return cut


@dataclass(frozen=True)
class Served:
    """A served world, what serves it in the order in which it acts, and how hosts find that."""

    world: ServedWorld
    companions: list[Companion]
    notes: list[str]


def serve(
    simulation: "Simulation",
    places: EventPlaces,
    experiment: Experiment,
    serving: Serving,
    writer: RunWriter,
) -> Served:
    """Opens all that programs outside find of the world.

    DeviceError or InputError if a port, an interface or a link is not to be had.
    """
    keys, duration = experiment.keys, ticks(experiment.keys.duration_s)
    companions: list[Companion] = []
    notes: list[str] = []
    with contextlib.ExitStack() as opened:
        overheads = []
        for number, link in enumerate(serving.ohc_links(experiment)):
            later_s = phase_s(keys.seed, number)
            overheads.append(ServedOverhead(simulation, link, number, later_s))
            opened.callback(overheads[-1].close)

        def begun() -> int | None:
            if keys.grid is None and keys.command:
                return 0
            return min((one.ran_at for one in overheads if one.ran_at is not None), default=None)

        def is_over() -> bool:
            return (zero := begun()) is not None and simulation.tick - zero >= duration

        begin = Begin(begun, is_over)
        if experiment.plan is not None:
            table = ServedTable(simulation, experiment, serving, writer)
            opened.callback(table.close)
            companions.append(table)
            notes += table.notes()
            begin = Begin(lambda: table.zero_tick, lambda: table.over, table.see)
        companions += overheads
        notes += [overhead.note for overhead in overheads]
        if serving.poses is not None:
            camera = ServedCamera(simulation, experiment, serving.poses)
            opened.callback(camera.close)
            companions.append(camera)
            notes.append(camera.note)
        elif experiment.environment is not None:
            notes.append(
                "the [environment] is played by `kilotwin record --via`, which needs --poses here"
            )
        opened.pop_all()
    if math.isinf(serving.speed):
        notes.append("with --fast time goes as it can: what is sent on a serial line is too slow")
    world = ServedWorld(simulation, places, duration, begin, serving.speed)
    return Served(world, companions, notes)
