"""An emulated table that waits on CAN buses for a host: `kilotwin serve world EXP.toml`.

Frames that end on its buses go out by the bridge, and what programs outside send goes onto them.
Time 0 of the run folder is the host's first RUN.
"""

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from kilotwin import _emulator
from kilotwin.errors import DeviceError
from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.folder import CAN_LOG
from kilotwin.runs.tracking import sites_of_cells
from kilotwin.runs.writer import RunWriter
from kilotwin.session.job import Serving
from kilotwin.session.loop import EachTick
from kilotwin.session.served_dispatcher import ServedDispatcher
from kilotwin.table.can.address import SOCKETCAND_PORT
from kilotwin.table.can.bridge import open_bridge
from kilotwin.table.grid import frames as wire
from kilotwin.table.grid.can_log import CanLog
from kilotwin.table.grid.links import Frames
from kilotwin.table.links.emulated_dispatcher import OLD
from kilotwin.units import TICK_S, seconds, ticks

if TYPE_CHECKING:
    from kilotwin._emulator import Bridge, Samples, Simulation

# After the run the host leaves robots and modules idle, and then sends nothing more. The table does
# not wait for a host that is gone.
_QUIET_S, _GRACE_S = 3.0, 30.0
_FLUSH_S = 0.5


class ServedTable(EachTick):
    """The engine's buses for programs outside, and a dispatcher on them."""

    def __init__(
        self,
        simulation: "Simulation",
        experiment: Experiment,
        serving: Serving,
        writer: RunWriter,
    ) -> None:
        """DeviceError if the port or an interface is not to be had."""
        assert experiment.plan is not None
        self._simulation = simulation
        self._plan = experiment.plan
        self._writer = writer
        self._duration = ticks(experiment.keys.duration_s)
        self._serving = serving
        layout = self._plan.layout
        self._source = experiment.origin.source
        self._dispatcher = ServedDispatcher(simulation, layout, serving.links.get("dispatcher"))
        try:
            self._bridge = _open(serving, layout.buses)
        except DeviceError:
            self._dispatcher.close()
            raise
        names = serving.interfaces or [f"can{bus}" for bus in range(layout.buses)]
        self._log: CanLog | None = None
        if experiment.keys.record.can_log:
            self._log = CanLog(writer.folder / CAN_LOG, names, zero_s=0.0)
        self._flushed = self._taken = time.monotonic()
        # Ticks of the last frame of the host, and of the last one that leaves all idle.
        self._received_at = self._idle_at = simulation.tick
        self.zero_tick: int | None = None
        """The engine's tick at the first RUN."""

    def notes(self) -> Iterator[str]:
        """How hosts find it, for people."""
        interfaces, port = self._serving.interfaces, self._bridge.port
        names = [f"socketcan:{name}" for name in interfaces] or [
            "socketcand:127.0.0.1" + ("" if port == SOCKETCAND_PORT else f":{port}")
        ]
        typed = " ".join(f"--can {name}" for name in names)
        yield (
            f"the table waits on {', '.join(interfaces) or f'port {port}'}; in another terminal "
            f"type: kilotwin record {self._source} {typed}"
        )
        yield self._dispatcher.note

    @property
    def over(self) -> bool:
        """Whether there is nothing more to wait for: the run is over, and the host quiet."""
        if self.zero_tick is None or self._simulation.tick - self.zero_tick < self._duration:
            return False
        end = self._duration + self.zero_tick
        waited = self._simulation.tick - max(self._received_at, end)
        return waited >= ticks(_GRACE_S if self._received_at > self._idle_at else _QUIET_S)

    def act(self, now: int) -> None:
        """Hands over frames both ways."""
        frames = self._simulation.can_frames()
        if len(frames):
            self._bridge.publish(frames)
            self._dispatcher.hear(frames)
            self._watch(frames)
            if self._log is not None:
                self._log.add(frames)
        self._pass_on()
        self._dispatcher.step(1)
        for note in self._bridge.notes():
            self._event("bus_client", note)
        if self._log is not None and time.monotonic() - self._flushed > _FLUSH_S:
            self._flushed = time.monotonic()
            self._log.flush()

    def _pass_on(self) -> None:
        """Frames from outside, a step later each, as they came: pauses between them stay pauses."""
        before, self._taken = self._taken, time.monotonic()
        lasted_s = max(self._taken - before, 1e-6)
        for bus, identifier, data, age_s in self._bridge.take():
            after_s = TICK_S * min(max(0.0, 1 - age_s / lasted_s), 1.0)
            self._simulation.send_can(bus, identifier, data, after_s)

    def see(self, samples: "Samples") -> None:
        """Corrects the sites in samples of the run: on a grid they are those of cells."""
        sites_of_cells(samples, self._plan.layout, self._plan.site_maps, TICK_S)

    def close(self) -> None:
        """Closes all connections, and the log."""
        self._dispatcher.close()
        self._bridge.close()
        if self._log is not None:
            self._log.close()

    def _watch(self, frames: Frames) -> None:
        """Notices when the run begins, and when the host has left the modules idle after it."""
        orders = frames[frames["from_host"] & (frames["dlc"] > 0)]
        kinds = orders["data"][:, 0]
        if self.zero_tick is None and (kinds == wire.fixed().RUN[0]).any():
            at_s = float(orders["at_s"][np.argmax(kinds == wire.fixed().RUN[0])])
            self.zero_tick = ticks(at_s)
            self._event("run", "a host has started the modules")
        if len(orders):
            self._received_at = self._simulation.tick
            stop, idle = wire.fixed().STOP[0], wire.fixed().IDLE[0]
            if kinds[-1] in (stop, idle, idle + OLD):
                self._idle_at = self._received_at

    def _event(self, kind: str, text: str) -> None:
        tick = self._simulation.tick - (self.zero_tick or 0)
        event = {"tick": tick, "kind": kind, "text": text, "time_s": round(seconds(tick), 3)}
        self._writer.add_event(event)


def _open(serving: Serving, buses: int) -> "Bridge":
    try:
        if serving.interfaces:
            return open_bridge(buses=buses, interfaces=serving.interfaces)
        if serving.port is None:
            return open_bridge(buses=buses)
        return open_bridge(buses=buses, port=serving.port, more_ports=0)
    except _emulator.BridgeError as error:
        if serving.interfaces:
            remedy = "type: ip link add dev vcan0 type vcan; ip link set vcan0 up"
            raise DeviceError(f"--can {serving.interfaces[0]}: {error}; {remedy}") from None
        what = "" if serving.port is None else f"--port {serving.port}: "
        raise DeviceError(f"{what}{error}; choose another with --port") from None
