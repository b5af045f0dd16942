"""Listens to a Kilogrid that a host elsewhere runs, and writes down what it hears; sends nothing.

On a CAN bus every node sees every frame: the host's polls, and the modules' answers with robots'
reports. Time 0 is when it begins to listen.
"""

import sys
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn, cast

import can
import numpy as np

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.files.headers import CAN_BIT_RATE
from kilotwin.runs.columns import TRACKING_SCHEMA
from kilotwin.runs.folder import TRACKING
from kilotwin.runs.tracking import Tracking
from kilotwin.runs.writer import RunWriter, Stream
from kilotwin.session.loop import Each, Session
from kilotwin.session.run import new_manifest
from kilotwin.session.wall import WallTable
from kilotwin.table.can.buses import BusName, open_all
from kilotwin.table.grid import frames as wire
from kilotwin.table.grid.can_links import CanLinks
from kilotwin.table.grid.cover import Group
from kilotwin.table.grid.links import Frames
from kilotwin.table.grid.poller import SILENT_AFTER, Poller
from kilotwin.units import ticks

_STEP_S = 0.02
_WRITE_S = 0.2
_RATES_OVER_S = 5.0
# Bits of a frame with a short identifier beside its data, and the pause behind it; stuffed bits,
# which depend on the data, are not counted.
_FRAME_BITS = 47


class _Ear:
    """A bus that can only be listened to."""

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """As the bus has it."""
        return self._bus.recv(timeout)

    def send(self, *_: Any) -> NoReturn:
        """Nothing here sends."""
        raise AssertionError("a listener sends nothing")

    def shutdown(self) -> None:
        """As the bus has it."""
        self._bus.shutdown()


class Overhearing:
    """Hears one grid into a folder like a recording's."""

    def __init__(self, experiment: Experiment, names: Sequence[BusName], folder: Path) -> None:
        """InputError without a [grid]; DeviceError if a bus cannot be opened."""
        if experiment.plan is None:
            raise InputError(f"{experiment.origin.source}: no [grid] to listen to; add it")
        opened = open_all(names)
        self._names = [bus.name for bus in opened]
        self._links = CanLinks([cast(can.BusABC, _Ear(bus.bus)) for bus in opened])
        plan = replace(experiment.plan, layout=experiment.plan.layout.on_buses(len(opened)))
        self._tracking = Tracking(experiment, plan.layout, plan.site_maps)
        self._poller = Poller(plan.layout, self._links, every_s=1, window=1, timeout_s=1)
        self._polls = {wire.id_of_group(Group(*module)): module for module in self._poller.modules}
        self._unanswered = dict.fromkeys(self._poller.modules, 0)
        manifest = {**new_manifest(experiment, [], sys.argv), "overheard_from": self._names}
        self._writer = RunWriter(folder, experiment, manifest)
        self._stream = Stream(folder / f"{TRACKING}.arrows", TRACKING_SCHEMA)
        self._began = time.monotonic()
        self._written_s = -1.0
        # When, frames and their bits on each bus, reports.
        self._lately: deque[tuple[float, Any, Any, int]] = deque()

    def run(self, ended: threading.Event) -> None:
        """Until `ended` is set."""
        table = WallTable(_STEP_S, ended.is_set)
        Session(table, [Each(lambda: self.step(time.monotonic() - self._began))]).run()

    def step(self, now_s: float) -> None:
        """Takes in what was on the buses since, and writes a sample if it is time to."""
        frames = self._links.receive(now_s)
        reports, _ = self._poller.take(frames, now_s)
        if reports is not None:
            self._stream.write(self._tracking.add(reports))
        self._count_answers(frames)
        buses = len(self._links)
        bits = _FRAME_BITS + 8.0 * frames["dlc"]
        self._lately.append(
            (
                now_s,
                np.bincount(frames["bus"], minlength=buses),
                np.bincount(frames["bus"], bits, minlength=buses),
                0 if reports is None else len(reports),
            )
        )
        while self._lately[0][0] < now_s - _RATES_OVER_S:
            self._lately.popleft()
        if now_s - self._written_s >= _WRITE_S:
            self._written_s = now_s
            self._writer.add(self._tracking.sample(ticks(now_s)))

    def _count_answers(self, frames: Frames) -> None:
        request = wire.fixed().TRACKING_REQUEST
        asked = (frames["id"] & 1 == 0) & (frames["data"][:, 0] == request[0])
        for frame in frames[asked]:
            if (module := self._polls.get(int(frame["id"]))) is not None:
                self._unanswered[module] += 1
        for frame in frames[frames["id"] & 1 == 1]:
            number = self._poller.number_of(int(frame["id"]))
            if number is not None:
                self._unanswered[self._poller.modules[number]] = 0

    def state(self) -> dict[str, Any]:
        """For the page: `buses`, each with its name, frames per second, load (share), and what is
        wrong; `reports_s`; `silent`, modules that left three polls in a row unanswered."""
        lately = list(self._lately)
        over_s = min(_RATES_OVER_S, max(1e-3, time.monotonic() - self._began))
        buses = []
        for bus, name in enumerate(self._names):
            frames = sum(int(row[1][bus]) for row in lately)
            bits = sum(float(row[2][bus]) for row in lately)
            buses.append(
                {
                    "name": name,
                    "frames_s": round(frames / over_s, 1),
                    "load": round(bits / over_s / CAN_BIT_RATE, 4),
                    "trouble": self._links.trouble(bus),
                }
            )
        return {
            "buses": buses,
            "reports_s": round(sum(row[3] for row in lately) / over_s, 1),
            "silent": [
                list(module)
                for module, number in list(self._unanswered.items())
                if number >= SILENT_AFTER
            ],
            "strangers": self._tracking.strangers,
        }

    def close(self) -> None:
        """Leaves the buses; the files are whole."""
        self._links.close()
        self._stream.close()
        self._writer.close(clean=False)
