"""Records an experiment on a grid at the other end of CAN buses, real or emulated, by wall time."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

from kilotwin.errors import EXIT_INTERRUPTED, EXIT_ROBOTS_FAILED, InputError, RunError, cause_of
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.engine import config_differences
from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.runs.folder import (
    FAILED,
    FINISHED,
    INTERRUPTED,
    check_free,
    close_manifest,
    default_folder,
)
from kilotwin.runs.grid_record import GridRecord
from kilotwin.runs.writer import RunWriter
from kilotwin.session.display import Display
from kilotwin.session.loop import Each, Session
from kilotwin.session.run import Outcome, new_manifest
from kilotwin.session.wall import SeenRecorder, WallTable, meter_of, recorded_summary
from kilotwin.table.can.buses import BusName, OpenBus, close_all, open_all
from kilotwin.table.grid.can_links import CanLinks
from kilotwin.table.grid.conductor import Conductor, set_up_s
from kilotwin.table.grid.foreign_orders import WatchedLinks, refuse_another_host, what_it_does
from kilotwin.table.grid.joining import check_runs
from kilotwin.table.grid.poller import Reports
from kilotwin.table.links.preflight import check_before_record
from kilotwin.table.links.readiness import MODULES, GridVerdict, line

if TYPE_CHECKING:
    from kilotwin._emulator import Samples

# Between two looks at the buses: well below the time that a module takes to answer.
_STEP_S = 0.001

# Events that are shown at once to the person at the table.
_WARNINGS = {"bus_down", "bus_up", "not_idle", "foreign_order"}


def record(
    experiment: Experiment,
    names: Sequence[BusName],
    folder: Path | None,
    command_line: list[str],
    display: Display,
    *,
    join: bool = False,
    takeover: bool = False,
    force: bool = False,
    speed: float = 1.0,
) -> Outcome:
    """Sets the grid up, runs it, polls it, leaves it idle; the results are in the run folder.

    Ctrl-C ends it early, robots and modules idle; a second one leaves them as they are. `join`
    takes over a grid that runs. A grid to which another host gives orders is refused, unless for
    `takeover`; one that comes later spoils the record. A grid with silent modules is refused,
    unless for `force`; what else is not right is a warning. It goes on without a bus that does not
    work any more, and ends when none is left. `speed`: seconds of the experiment per second, as the
    table has it.
    """
    if experiment.plan is None:
        raise InputError(f"{experiment.origin.source}: no [grid] to record; add it, or use run")
    folder = folder or default_folder(experiment)
    check_free(folder)
    buses = open_all(names)
    try:
        links = CanLinks([bus.bus for bus in buses], echoes=[bus.echoes for bus in buses])
        if not takeover:
            refuse_another_host(links, [str(name) for name in names])
        if all(bus.answers for bus in buses):
            if join:
                check_runs(experiment.plan, links)
            else:
                _check(experiment, buses, names, display, force=force, speed=speed)
        return _Recording(
            experiment,
            buses,
            folder,
            command_line,
            display,
            names=names,
            join=join,
            speed=speed,
        ).run()
    finally:
        display.stop()
        close_all(buses)


def _check(
    experiment: Experiment,
    buses: Sequence[OpenBus],
    names: Sequence[BusName],
    display: Display,
    *,
    force: bool,
    speed: float,
) -> None:
    """The preflight; RunError if modules are silent, unless for `force`."""
    found = check_before_record(experiment, buses, names, speed=speed, note=display.note)
    wrong = [finding for finding in found if finding.verdict is not GridVerdict.READY]
    refused = [finding for finding in wrong if finding.what == MODULES and not force]
    for finding in wrong:
        if finding not in refused:
            display.warn(line(finding))
    if refused:
        raise RunError(f"{line(refused[0])}; or add --force")


class _Recording:
    """One experiment on open buses."""

    def __init__(
        self,
        experiment: Experiment,
        buses: Sequence[OpenBus],
        folder: Path,
        command_line: list[str],
        display: Display,
        *,
        names: Sequence[BusName],
        join: bool,
        speed: float,
    ) -> None:
        assert experiment.plan is not None
        plan = replace(experiment.plan, layout=experiment.plan.layout.on_buses(len(buses)))
        self._experiment = experiment
        self._keys = experiment.keys
        self._names = [str(name) for name in names]
        self._display = display
        messages = config_differences(experiment)
        lead_s = 0.0 if join else set_up_s(plan, len(messages), _STEP_S)
        self._table = WallTable(_STEP_S, self._is_done, speed=speed, lead_s=lead_s)
        manifest = {
            **new_manifest(experiment, [], command_line),
            "recorded_from": [bus.name for bus in buses],
        }
        meter = meter_of(experiment)
        try:
            self._writer = RunWriter(folder, experiment, manifest)
        except OSError as error:
            raise InputError(f"--out {folder}: {cause_of(error)}; name another folder") from None
        self._record = GridRecord(
            self._writer, experiment, [bus.name for bus in buses], time.time() + lead_s / speed
        )
        self._buses = CanLinks(
            [bus.bus for bus in buses],
            self._record.log,
            echoes=[bus.echoes for bus in buses],
        )
        self._links = WatchedLinks(self._buses, announces=all(bus.answers for bus in buses))
        self._unwritten = False  # once the folder takes no more
        self._told_of: set[tuple[int, str]] = set()
        self._conductor = Conductor(
            plan,
            messages,
            self._keys.duration_s,
            self._links,
            self,
            join=join,
        )
        self._samples = SeenRecorder(
            experiment, self._writer, meter, display, run_s=self._run_s, seen=self._seen
        )
        self._interrupts = 0
        self._lost_s: float | None = None  # when no bus was left, if that was before the end
        display.note(f"set-up, {lead_s:.0f} s" if lead_s else "takes over a grid that runs")
        display.start(experiment, folder)

    def run(self) -> Outcome:
        """To the end, or until interrupted twice. RunError if the folder cannot be written."""
        try:
            self._run_to_end()
            return self._close()
        except OSError as error:
            raise self._stop_unwritten(cause_of(error)) from None

    def _run_to_end(self) -> None:
        host = Each(self._conduct)
        watches = [Each(self._look_at_buses), Each(self._look_for_other_hosts)]
        with self._heeding_signals():
            Session(self._table, [host, *watches, Each(self._record.flush), self._samples]).run()
            self._record.flush(now=True)

    def _is_done(self) -> bool:
        return self._conductor.phase == "done"

    def _conduct(self) -> None:
        self._conductor.step(self._table.now_s)

    def _run_s(self) -> float:
        """The run's time; below 0 while the table is set up or left."""
        running = self._conductor.phase == "running"
        return self._table.now_s - self._conductor.zero_s if running else -1.0

    def _seen(self, tick: int) -> "Samples":
        """Robots as the last reports have them."""
        self._record.flush(now=True)
        return self._record.tracking.sample(tick)

    def _stop_unwritten(self, cause: str) -> RunError:
        """Leaves robots and modules idle, unrecorded, and a manifest that says why."""
        folder = self._writer.folder
        error = RunError(f"{folder}: cannot write ({cause}); robots and modules are idle now")
        self._unwritten = True
        self._buses.forget_log()
        with self._heeding_signals():
            self._conductor.end()
            Session(self._table, [Each(self._conduct)]).run()
        self._record.give_up()
        with suppress(OSError):
            self._writer.close(clean=False)
        with suppress(OSError):
            close_manifest(folder, FAILED, error.exit_code, reason=f"cannot write ({cause})")
        return error

    def reports(self, reports: Reports) -> None:
        """Keeps reports of robots."""
        if not self._unwritten:
            self._record.reports(reports)

    def event(self, time_s: float, kind: str, text: str, **more: Any) -> None:
        """Keeps an event, and shows those that must be known at once."""
        if not self._unwritten:
            self._record.event(time_s, kind, text, **more)
        if kind in _WARNINGS:
            self._display.warn(f"at {time_s:,.0f} s: {text}")

    def _look_at_buses(self) -> None:
        conductor = self._conductor
        all_down = len(conductor.controller.down) == len(self._names)
        if all_down and conductor.phase not in ("ending", "done"):
            self._lost_s = self._table.now_s - conductor.zero_s
            self._display.warn("no bus is left: the record ends; what was recorded is kept")
            conductor.end()

    def _look_for_other_hosts(self) -> None:
        for bus, kind in [order for order in self._links.foreign if order not in self._told_of]:
            self._told_of.add((bus, kind))
            what = f"{self._names[bus]}: {what_it_does(kind)} ({kind}); the record is spoiled"
            run_s = self._table.now_s - self._conductor.zero_s
            self.event(run_s, "foreign_order", what, bus=bus)

    @contextmanager
    def _heeding_signals(self) -> Iterator[None]:
        def heed(number: int, frame: FrameType | None) -> None:
            self._interrupts += 1
            if self._interrupts == 1:
                self._conductor.end()
            else:
                self._conductor.leave()

        with heeding_interrupts(heed):
            yield

    def _close(self) -> Outcome:
        run_s = self._lost_s
        if run_s is None:
            run_s = self._table.now_s - self._conductor.zero_s
        run_s = min(max(run_s, 0.0), self._keys.duration_s)
        self._samples.write(run_s, last=True)
        self._record.close()
        status, exit_code, why = FINISHED, 0, {}
        if self._interrupts:
            status, exit_code = INTERRUPTED, EXIT_INTERRUPTED
        elif self._lost_s is not None:
            status, exit_code = FAILED, RunError.exit_code
            why = {"reason": f"no bus was left at {run_s:,.0f} s"}
        summary = self._summary(run_s, status)
        troubles = ("modules_failed", "buses_down", "not_idle", "foreign_orders")
        if status == FINISHED and any(summary["grid"][trouble] for trouble in troubles):
            exit_code = EXIT_ROBOTS_FAILED
        if self._links.foreign:
            why = {**why, "spoiled": "another host was on the table"}
        self._writer.close(clean=status == FINISHED)
        close_manifest(self._writer.folder, status, exit_code, summary=summary, **why)
        return Outcome(summary, exit_code)

    def _summary(self, run_s: float, status: str) -> dict[str, Any]:
        controller = self._conductor.controller
        layout, poller = controller.layout, controller.poller
        return {
            **recorded_summary(self._experiment, self._table, self._writer, status, run_s),
            **self._samples.summary(),
            "grid": {
                "reports": poller.counts.reports,
                "strangers": self._record.tracking.strangers,
                "polls": poller.counts.asked,
                "polls_missed": poller.counts.missed,
                "reports_cut": poller.counts.cut,
                "bad_frames": poller.counts.bad_frames,
                "modules_failed": self._record.failed_modules(controller.silent),
                "size": f"{layout.columns}x{layout.rows}",
                "buses": self._names,
                "buses_down": [
                    {"bus": bus, "name": self._names[bus], "what": what}
                    for bus, what in controller.down.items()
                ],
                "foreign_orders": [
                    {"bus": self._names[bus], "order": kind, "times": times}
                    for (bus, kind), times in sorted(self._links.foreign.items())
                ],
                "not_idle": [self._names[bus] for bus in self._conductor.unsent],
                "kilodat": str(self._record.kilodat),
            },
        }
