"""A world that waits for hosts outside: `kilotwin run EXP.toml --serve`.

Robots have an overhead controller above them, and a table below them its CAN buses. The engine
keeps pace with the wall, or goes `speed` times as fast. Time 0 of the run folder is the host's
first RUN; without a grid and with [[command]] it is when the robots were switched on.
"""

import contextlib
import math
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.record import EXTRA_OF
from kilotwin.runs.writer import RunWriter
from kilotwin.session.job import Serving
from kilotwin.session.served_camera import ServedCamera
from kilotwin.session.served_grid import ServedTable
from kilotwin.session.served_overhead import ServedOverhead
from kilotwin.units import seconds, ticks

if TYPE_CHECKING:
    from kilotwin._emulator import Samples, Simulation

_NEVER = 2**62


class ServedWorld:
    """The engine in the pace of the wall, and what programs outside find of it."""

    def __init__(
        self, simulation: "Simulation", experiment: Experiment, serving: Serving, writer: RunWriter
    ) -> None:
        """DeviceError or InputError if a port, an interface or a link is not to be had."""
        self._simulation = simulation
        self._serving = serving
        self._duration = ticks(experiment.keys.duration_s)
        self._begins_at_once = experiment.keys.grid is None and bool(experiment.keys.command)
        self._overhead = ServedOverhead(simulation, serving.ohc_link)
        self._camera: ServedCamera | None = None
        self._plays_outside = experiment.environment is not None
        self._table: ServedTable | None = None
        with contextlib.ExitStack() as opened:
            opened.callback(self._overhead.close)
            if serving.poses is not None:
                self._camera = ServedCamera(simulation, experiment, serving.poses)
                opened.callback(self._camera.close)
            if experiment.plan is not None:
                self._table = ServedTable(simulation, experiment, serving, writer)
            opened.pop_all()
        self._begin_tick = simulation.tick
        self._began = time.monotonic()

    def notes(self) -> Iterator[str]:
        """How hosts find all of it, for people."""
        if self._table is not None:
            yield from self._table.notes()
        yield self._overhead.note
        if self._camera is not None:
            yield self._camera.note
        elif self._plays_outside:
            yield "the [environment] is played by `kilotwin record --via`, which needs --poses here"
        if math.isinf(self._serving.speed):
            yield "with --fast time goes as it can: what is sent on a serial line comes too slowly"

    @property
    def zero_tick(self) -> int | None:
        """The engine's tick when the run began; None before that."""
        if self._table is not None:
            return self._table.zero_tick
        return 0 if self._begins_at_once else self._overhead.ran_at

    @property
    def ran(self) -> bool:
        """Whether the whole run is over."""
        zero = self.zero_tick
        return zero is not None and self._simulation.tick - zero >= self._duration

    @property
    def over(self) -> bool:
        """Whether there is nothing more to wait for."""
        return self._table.over if self._table is not None else self.ran

    def step(self) -> None:
        """Goes on by a tick, and hands over what has come both ways."""
        self._overhead.step(1)
        if self._camera is not None:
            self._camera.step()
        self._simulation.advance(1)
        if self._table is not None:
            self._table.step()

    def wait(self) -> None:
        """Until the wall has come to where the engine is."""
        if math.isinf(self._serving.speed):
            return
        simulated_s = seconds(self._simulation.tick - self._begin_tick)
        ahead_s = simulated_s / self._serving.speed - (time.monotonic() - self._began)
        if ahead_s > 0:
            time.sleep(ahead_s)

    def from_zero(self, samples: "Samples") -> "Samples":
        """Those of the run, their times since its begin."""
        zero = _NEVER if self.zero_tick is None else self.zero_tick
        kept = (samples["tick"] >= zero) & (samples["tick"] <= zero + self._duration)
        # Without objects there are no rows of them.
        of_objects = kept if len(samples["object_x_m"]) else slice(0)
        cut: Samples = {
            "tick": samples["tick"][kept] - zero,
            "x_m": samples["x_m"][kept],
            "y_m": samples["y_m"][kept],
            "heading_rad": samples["heading_rad"][kept],
            "led": samples["led"][kept],
            "site": samples["site"][kept],
            "object_x_m": samples["object_x_m"][of_objects],
            "object_y_m": samples["object_y_m"][of_objects],
            "object_heading_rad": samples["object_heading_rad"][of_objects],
        }
        for name in EXTRA_OF.keys() & samples.keys():
            cut[name] = samples[name][kept]  # type: ignore[literal-required]
        if self._table is not None:
            self._table.see(cut)
        return cut

    def close(self) -> None:
        """Closes all connections, and the log."""
        self._overhead.close()
        if self._camera is not None:
            self._camera.close()
        if self._table is not None:
            self._table.close()
