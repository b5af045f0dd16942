"""Plays an environment to robots on a table, real or emulated: poses come, a controller shines.

By wall time. Nothing comes back from robots but what the tracker sees of them.
"""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from kilotwin.errors import (
    EXIT_INTERRUPTED,
    EXIT_ROBOTS_FAILED,
    InputError,
    KilotwinError,
    RunError,
    cause_of,
)
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.spec.engine import config_messages
from kilotwin.experiment.spec.informed import informed_for
from kilotwin.experiment.spec.overhead import RUN, WAKEUP, message_of
from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.metrics.functions import LocalFunctions
from kilotwin.metrics.meter import Meter, metrics_summary
from kilotwin.runs.environment_record import EnvironmentRecord
from kilotwin.runs.folder import (
    FAILED,
    FINISHED,
    INTERRUPTED,
    check_free,
    close_manifest,
    default_folder,
)
from kilotwin.runs.writer import RunWriter
from kilotwin.session.display import Display
from kilotwin.session.run import Outcome, new_manifest
from kilotwin.session.seen_robots import SeenRobots
from kilotwin.table.environment.outbox import Sending
from kilotwin.table.environment.play import Play
from kilotwin.table.environment.poses import Address, PoseListener
from kilotwin.table.environment.protocol import Seen
from kilotwin.table.links.packets import OVERHEAD_BAUD, Overhead, encode
from kilotwin.table.ports.serial_port import SerialPort
from kilotwin.units import ticks

_STEP_S = 0.002
_PROGRESS_S = 0.5
# Each order is repeated for so long; a robot misses few of some twenty frames, but not all.
_HOLD_S, _ORDER_S = 1.0, 0.25
# Without any pose for so long a person is told.
_BLIND_S = 5.0
_TROUBLE_S = 10.0


@dataclass(frozen=True)
class Table:
    """Where robots are: an overhead controller's port, and the address that poses come to.

    `speed`: seconds of the experiment per second, as an emulated table has it.
    """

    port: str
    poses: Address
    speed: float = 1.0


def record(
    experiment: Experiment,
    table: Table,
    folder: Path | None,
    command_line: list[str],
    display: Display,
) -> Outcome:
    """Starts the robots, plays the environment for duration_s, pauses them; leaves a run folder.

    Ctrl-C ends it early, robots paused. InputError leaves no folder; DeviceError for port and
    address.
    """
    if experiment.environment is None:
        what = "no [environment] to play; add it, or name a grid's buses by --can"
        raise InputError(f"{experiment.origin.source}: {what}")
    _check_commands(experiment)
    folder = folder or default_folder(experiment)
    check_free(folder)
    port = SerialPort(table.port, OVERHEAD_BAUD)
    try:
        listener = PoseListener(table.poses)
        try:
            recording = _Recording(experiment, table, port, listener, display)
            return recording.run(folder, command_line)
        finally:
            listener.close()
    finally:
        display.stop()
        port.close()


def _check_commands(experiment: Experiment) -> None:
    for index, command in enumerate(experiment.keys.command or []):
        for key in ("robot", "uid_first", "uid_last", "centre_m"):
            if getattr(command, key) is not None:
                what = f"an overhead controller's orders reach all robots; remove '{key}'"
                raise experiment.error(("command", index, key), what)


class _Recording:
    """One experiment on an open port."""

    def __init__(
        self,
        experiment: Experiment,
        table: Table,
        port: SerialPort,
        listener: PoseListener,
        display: Display,
    ) -> None:
        self._experiment, self._keys = experiment, experiment.keys
        self._table, self._port, self._listener = table, port, listener
        self._display = display
        self._record: EnvironmentRecord | None = None
        self._notes: list[tuple[float, str]] = []
        """Notes of the program before there is a record."""
        self._play = Play(experiment, self)
        self._robots = SeenRobots(experiment)
        functions = LocalFunctions(experiment) if experiment.functions else None
        self._meter = Meter(experiment, functions)
        self._interrupted = False
        self._next_sample = 0
        self._shown_at = self._told_at = -math.inf
        self._told_bad = 0
        self._blind = True
        self._until_s = 0.0
        self._lead_s = self._give_orders()
        self._began = time.monotonic()

    def _give_orders(self) -> float:
        """Puts all orders into the outbox; how long those before t = 0 take."""
        keys, outbox = self._keys, self._play.outbox
        configs = [message for _, _, message in config_messages(self._experiment)]
        lead_s = _ORDER_S * len(configs)
        for number, message in enumerate(configs):
            outbox.order(_ORDER_S * number - lead_s, message, _ORDER_S)
        if keys.command is None:
            outbox.order(0.0, RUN, _HOLD_S)
        profile = PROFILES[keys.swarm.profile]
        for command in sorted(keys.command or [], key=lambda command: command.at_s):
            hold_s = max(command.repeat_s, _ORDER_S)
            outbox.order(command.at_s, message_of(command, profile), hold_s)
        return lead_s

    def sent(self, sending: Sending) -> None:
        """See play.Listener."""
        if self._record is not None:
            self._record.sent(sending)

    def note(self, time_s: float, text: str) -> None:
        """See play.Listener."""
        if self._record is None:
            self._notes.append((time_s, text))
        else:
            self._record.note(time_s, text)

    def run(self, folder: Path, command_line: list[str]) -> Outcome:
        """To the end, or until interrupted."""
        manifest = {
            **new_manifest(self._experiment, [], command_line),
            "recorded_from": [f"ohc:{self._table.port}"],
        }
        try:
            writer = RunWriter(folder, self._experiment, manifest)
        except OSError as error:
            raise InputError(f"--out {folder}: {cause_of(error)}; name another folder") from None
        self._record = record = EnvironmentRecord(writer)
        for time_s, text in self._notes:
            record.note(time_s, text)
        self._display.start(self._experiment, folder)
        self._began = time.monotonic()
        try:
            with self._heeding_signals():
                self._go_on(writer, record)
                self._pause_robots()
        except KilotwinError as error:
            self._close(writer, FAILED, error.exit_code, reason=str(error))
            raise
        if self._interrupted:
            return self._close(writer, INTERRUPTED, EXIT_INTERRUPTED)
        exit_code = EXIT_ROBOTS_FAILED if self._robots.never_seen else 0
        return self._close(writer, FINISHED, exit_code)

    def _go_on(self, writer: RunWriter, record: EnvironmentRecord) -> None:
        try:
            while self._now_s() < self._keys.duration_s and not self._interrupted:
                now_s = self._now_s()
                self._look(now_s, record)
                self._talk(now_s)
                if now_s >= 0:
                    self._sample(now_s, writer)
                time.sleep(_STEP_S)
        except RunError:  # of the program: the robots are not to drive on
            self._pause_robots()
            raise

    def _look(self, now_s: float, record: EnvironmentRecord) -> None:
        """Shows the program what has come, if anything, and a person what is wrong with it."""
        robots = self._robots.take(self._listener.take())
        if robots:
            self._blind = False
            if now_s >= 0:
                self._play.show(Seen(now_s, robots), now_s)
        bad = self._listener.bad_lines - self._told_bad
        if bad and time.monotonic() - self._told_at > _TROUBLE_S:
            self._told_at, self._told_bad = time.monotonic(), self._listener.bad_lines
            self._warn(
                now_s, record, f"{bad} lines of poses are of no use: {self._listener.trouble}"
            )
        if self._blind and now_s > _BLIND_S * self._table.speed:
            self._blind = False
            where = f"udp:{self._table.poses[0]}:{self._table.poses[1]}"
            self._warn(now_s, record, f"no poses come to {where}; is the tracker on?")

    def _warn(self, now_s: float, record: EnvironmentRecord, text: str) -> None:
        self._display.warn(f"at {now_s:,.0f} s: {text}")
        record.event(now_s, "poses", text)

    def _talk(self, now_s: float) -> None:
        for sending in self._play.sendings(self._until_s, now_s):
            self._port.write(sending.packet)
        self._until_s = now_s

    def _pause_robots(self) -> None:
        """By the light that robots have obeyed so far; nothing says whether they did."""
        self._port.write(encode(Overhead.FORWARDMSG, WAKEUP))
        time.sleep(_HOLD_S / self._table.speed)
        self._port.write(encode(Overhead.STOP))

    def _now_s(self) -> float:
        return (time.monotonic() - self._began) * self._table.speed - self._lead_s

    def _sample(self, now_s: float, writer: RunWriter) -> None:
        sample_s = self._keys.record.sample_s
        if now_s < self._next_sample * sample_s:
            return
        self._next_sample = int(now_s / sample_s) + 1
        self._write_sample(now_s, writer)

    def _write_sample(
        self, now_s: float, writer: RunWriter, *, last: bool = False
    ) -> dict[str, Any]:
        sample = self._robots.sample(ticks(now_s))
        counts = writer.add(sample, self._meter.measure(sample, None, last=last))
        assert counts is not None
        names = [site.name for site in self._keys.site]
        resting = dict(zip(names, counts.resting[-1].tolist(), strict=True))
        not_resting = int(counts.not_resting[-1])
        if time.monotonic() - self._shown_at > _PROGRESS_S:
            self._shown_at = time.monotonic()
            self._display.progress(ticks(now_s), resting, not_resting, self._meter.latest)
        return {"resting": resting, "not_resting": not_resting}

    @contextmanager
    def _heeding_signals(self) -> Iterator[None]:
        def heed(number: int, frame: FrameType | None) -> None:
            self._interrupted = True

        with heeding_interrupts(heed):
            yield

    def _close(self, writer: RunWriter, status: str, exit_code: int, **why: Any) -> Outcome:
        run_s = min(max(self._now_s(), 0.0), self._keys.duration_s)
        robots_now = self._write_sample(run_s, writer, last=True)
        assert self._record is not None
        self._record.close()
        summary = {
            "experiment": self._keys.name,
            "seed": self._keys.seed,
            "status": status,
            "duration_s": self._keys.duration_s,
            "recorded_s": round(run_s, 3),
            "robots": self._experiment.size,
            **robots_now,
            "informed": informed_for(self._keys),
            "metrics": metrics_summary(self._keys, self._meter.latest),
            "metrics_failed": self._meter.failed,
            "wall_s": round(time.monotonic() - self._began, 3),
            "run_folder": str(writer.folder),
            "environment": self._play.summary(),
            "poses": {
                "lines": self._listener.lines,
                "bad_lines": self._listener.bad_lines,
                "strangers": self._robots.strangers,
                "never_seen": self._robots.never_seen,
            },
        }
        writer.close(clean=status == FINISHED)
        close_manifest(writer.folder, status, exit_code, summary=summary, **why)
        return Outcome(summary, exit_code)
