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
from kilotwin.experiment.spec.overhead import RUN, WAKEUP, message_of
from kilotwin.files.interrupts import heeding_interrupts
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
from kilotwin.session.loop import Each, Session
from kilotwin.session.run import Outcome, new_manifest
from kilotwin.session.seen_robots import SeenRobots
from kilotwin.session.wall import SeenRecorder, WallTable, meter_of, recorded_summary
from kilotwin.table.environment.outbox import Sending
from kilotwin.table.environment.play import Play
from kilotwin.table.environment.poses import Address, PoseListener
from kilotwin.table.environment.protocol import Seen
from kilotwin.table.links.packets import OVERHEAD_BAUD, Overhead, encode
from kilotwin.table.ports.serial_port import SerialPort

_STEP_S = 0.002
_PROGRESS_S = 0.5
# Each order is repeated for so long; a robot misses few of some twenty frames, but not all.
_HOLD_S, _ORDER_S = 1.0, 0.25
# Without any pose for so long a person is told.
_BLIND_S = 5.0
_TROUBLE_S = 10.0


@dataclass(frozen=True)
class Setup:
    """Where robots are: an overhead controller's port, and the address that poses come to.

    `speed`: seconds of the experiment per second, as an emulated table has it.
    """

    port: str
    poses: Address
    speed: float = 1.0


def record(
    experiment: Experiment,
    setup: Setup,
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
    if len(experiment.keys.overhead) > 1:
        number = len(experiment.keys.overhead)
        what = f"--via names one overhead controller, here are {number}; remove all but that one"
        raise experiment.error(("overhead", 1), what)
    _check_commands(experiment)
    folder = folder or default_folder(experiment)
    check_free(folder)
    port = SerialPort(setup.port, OVERHEAD_BAUD)
    try:
        listener = PoseListener(setup.poses)
        try:
            recording = _Recording(experiment, setup, port, listener, display)
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
        setup: Setup,
        port: SerialPort,
        listener: PoseListener,
        display: Display,
    ) -> None:
        self._experiment, self._keys = experiment, experiment.keys
        self._setup, self._port, self._listener = setup, port, listener
        self._display = display
        self._record: EnvironmentRecord | None = None
        self._notes: list[tuple[float, str]] = []
        """Notes of the program before there is a record."""
        self._play = Play(experiment, self)
        self._robots = SeenRobots(experiment)
        self._meter = meter_of(experiment)
        self._interrupted = False
        self._told_at = -math.inf
        self._told_bad = 0
        self._blind = True
        self._until_s = 0.0
        self._table = WallTable(
            _STEP_S, self._is_over, speed=setup.speed, lead_s=self._give_orders()
        )

    def _give_orders(self) -> float:
        """Puts all orders into the outbox; how long those before t = 0 take."""
        keys, outbox = self._keys, self._play.outboxes.boxes[0]
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
            "recorded_from": [f"ohc:{self._setup.port}"],
        }
        try:
            writer = RunWriter(folder, self._experiment, manifest)
        except OSError as error:
            raise InputError(f"--out {folder}: {cause_of(error)}; name another folder") from None
        self._record = EnvironmentRecord(writer)
        for time_s, text in self._notes:
            self._record.note(time_s, text)
        self._display.start(self._experiment, folder)
        table = self._table
        table.start()
        samples = SeenRecorder(
            self._experiment,
            writer,
            self._meter,
            self._display,
            run_s=lambda: table.now_s,
            seen=self._robots.sample,
        )
        try:
            with self._heeding_signals():
                self._go_on(samples)
                self._pause_robots()
        except KilotwinError as error:
            self._close(writer, samples, FAILED, error.exit_code, reason=str(error))
            raise
        if self._interrupted:
            return self._close(writer, samples, INTERRUPTED, EXIT_INTERRUPTED)
        exit_code = EXIT_ROBOTS_FAILED if self._robots.never_seen else 0
        return self._close(writer, samples, FINISHED, exit_code)

    def _is_over(self) -> bool:
        return self._interrupted or self._table.now_s >= self._keys.duration_s

    def _go_on(self, samples: SeenRecorder) -> None:
        try:
            Session(self._table, [Each(self._look), Each(self._talk), samples]).run()
        except RunError:  # of the program: the robots are not to drive on
            self._pause_robots()
            raise

    def _look(self) -> None:
        """Shows the program what has come, if anything, and a person what is wrong with it."""
        now_s = self._table.now_s
        robots = self._robots.take(self._listener.take())
        if robots:
            self._blind = False
            if now_s >= 0:
                self._play.show(Seen(now_s, robots), now_s)
        bad = self._listener.bad_lines - self._told_bad
        if bad and time.monotonic() - self._told_at > _TROUBLE_S:
            self._told_at, self._told_bad = time.monotonic(), self._listener.bad_lines
            what = "1 line of poses is" if bad == 1 else f"{bad} lines of poses are"
            self._warn(now_s, f"{what} of no use: {self._listener.trouble}")
        if self._blind and now_s > _BLIND_S * self._setup.speed:
            self._blind = False
            where = f"udp:{self._setup.poses[0]}:{self._setup.poses[1]}"
            self._warn(now_s, f"no poses come to {where}; is the tracker on?")

    def _warn(self, now_s: float, text: str) -> None:
        self._display.warn(f"at {now_s:,.0f} s: {text}")
        assert self._record is not None
        self._record.event(now_s, "poses", text)

    def _talk(self) -> None:
        now_s = self._table.now_s
        for sending in self._play.sendings(self._until_s, now_s):
            self._port.write(sending.packet)
        self._until_s = now_s

    def _pause_robots(self) -> None:
        """By the light that robots have obeyed so far; nothing says whether they did."""
        self._port.write(encode(Overhead.FORWARDMSG, WAKEUP))
        time.sleep(_HOLD_S / self._setup.speed)
        self._port.write(encode(Overhead.STOP))

    @contextmanager
    def _heeding_signals(self) -> Iterator[None]:
        def heed(number: int, frame: FrameType | None) -> None:
            self._interrupted = True

        with heeding_interrupts(heed):
            yield

    def _close(
        self, writer: RunWriter, samples: SeenRecorder, status: str, exit_code: int, **why: Any
    ) -> Outcome:
        run_s = min(max(self._table.now_s, 0.0), self._keys.duration_s)
        samples.write(run_s, last=True)
        assert self._record is not None
        self._record.close()
        summary = {
            **recorded_summary(self._experiment, self._table, writer, status, run_s),
            **samples.summary(),
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
