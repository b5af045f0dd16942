"""Records an experiment on a grid at the other end of CAN buses, real or emulated, by wall time."""

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

from kilotwin.can.buses import BusName, OpenBus, open_all
from kilotwin.engine_spec import config_differences
from kilotwin.errors import EXIT_INTERRUPTED, EXIT_ROBOTS_FAILED, InputError
from kilotwin.experiment import Experiment
from kilotwin.grid.conductor import Conductor, set_up_s
from kilotwin.grid.grid_record import GridRecord
from kilotwin.grid.links import Links
from kilotwin.informed import informed_for
from kilotwin.interrupts import heeding_interrupts
from kilotwin.run import Display, Outcome, new_manifest
from kilotwin.run_folder import (
    FINISHED,
    INTERRUPTED,
    check_free,
    close_manifest,
    default_folder,
)
from kilotwin.run_writer import RunWriter
from kilotwin.units import ticks

# Between two looks at the buses: well below the time that a module takes to answer.
_STEP_S = 0.001
_PROGRESS_S = 0.5


def record(
    experiment: Experiment,
    names: Sequence[BusName],
    folder: Path | None,
    command_line: list[str],
    display: Display,
    *,
    join: bool = False,
    speed: float = 1.0,
) -> Outcome:
    """Sets the grid up, runs it, polls it, leaves it idle; the run folder says what came of it.

    Ctrl-C ends it early, robots and modules idle; a second one leaves them as they are. `join`
    takes over a grid that runs. `speed`: seconds of the experiment per second, as the table has it.
    """
    if experiment.plan is None:
        raise InputError(f"{experiment.origin.source}: no [grid] to record; add it, or use run")
    folder = folder or default_folder(experiment)
    check_free(folder)
    buses = open_all(names)
    try:
        return _Recording(
            experiment, buses, folder, command_line, display, join=join, speed=speed
        ).run()
    finally:
        display.stop()
        for bus in buses:
            bus.bus.shutdown()


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
        join: bool,
        speed: float,
    ) -> None:
        assert experiment.plan is not None
        self._experiment = experiment
        self._keys = experiment.keys
        self._display = display
        messages = config_differences(self._keys)
        lead_s = 0.0 if join else set_up_s(experiment.plan, len(messages), _STEP_S)
        self._began = time.monotonic()
        self._lead_s = lead_s
        self._speed = speed
        manifest = {
            **new_manifest(experiment, [], command_line),
            "recorded_from": [bus.name for bus in buses],
        }
        try:
            self._writer = RunWriter(folder, experiment, manifest)
        except OSError as error:
            raise InputError(f"--out {folder}: {error.strerror}; name another folder") from None
        self._record = GridRecord(
            self._writer, experiment, [bus.name for bus in buses], time.time() + lead_s / speed
        )
        self._conductor = Conductor(
            experiment.plan,
            messages,
            self._keys.duration_s,
            Links(
                [bus.bus for bus in buses],
                self._record.log,
                echoes=[bus.echoes for bus in buses],
            ),
            self._record,
            join=join,
        )
        self._sample_s = self._keys.record.sample_s
        self._next_sample = 0
        self._interrupts = 0
        self._shown_at = -math.inf
        display.note(f"set-up, {lead_s:.0f} s" if lead_s else "takes over a grid that runs")
        display.start(experiment, folder)

    def run(self) -> Outcome:
        """To the end, or until interrupted twice."""
        with self._heeding_signals():
            while self._conductor.phase != "done":
                now_s = self._now_s()
                self._conductor.step(now_s)
                self._record.flush()
                if self._conductor.phase == "running":
                    self._sample(now_s - self._conductor.zero_s)
                time.sleep(_STEP_S)
            self._record.flush(now=True)
        return self._close()

    def _now_s(self) -> float:
        return (time.monotonic() - self._began) * self._speed - self._lead_s

    def _sample(self, time_s: float) -> None:
        if time_s < self._next_sample * self._sample_s or time_s < 0:
            return
        self._next_sample = int(time_s / self._sample_s) + 1
        self._record.flush(now=True)
        self._write_sample(time_s)

    def _write_sample(self, time_s: float) -> None:
        counts = self._writer.add(self._record.tracking.sample(ticks(time_s)))
        assert counts is not None
        names = [site.name for site in self._keys.site]
        self._resting = dict(zip(names, counts.resting[-1].tolist(), strict=True))
        self._not_resting = int(counts.not_resting[-1])
        if time.monotonic() - self._shown_at > _PROGRESS_S:
            self._shown_at = time.monotonic()
            self._display.progress(ticks(time_s), self._resting, self._not_resting)

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
        run_s = self._now_s() - self._conductor.zero_s
        run_s = min(max(run_s, 0.0), self._keys.duration_s)
        self._write_sample(run_s)
        self._record.close()
        interrupted = self._interrupts > 0
        summary = self._summary(run_s, interrupted)
        exit_code = EXIT_INTERRUPTED if interrupted else 0
        if not interrupted and summary["grid"]["modules_failed"]:
            exit_code = EXIT_ROBOTS_FAILED
        self._writer.close(clean=not interrupted)
        close_manifest(self._writer.folder, summary["status"], exit_code, summary=summary)
        return Outcome(summary, exit_code)

    def _summary(self, run_s: float, interrupted: bool) -> dict[str, Any]:
        poller = self._conductor.controller.poller
        return {
            "experiment": self._keys.name,
            "seed": self._keys.seed,
            "status": INTERRUPTED if interrupted else FINISHED,
            "duration_s": self._keys.duration_s,
            "recorded_s": round(run_s, 3),
            "robots": self._experiment.size,
            "resting": self._resting,
            "not_resting": self._not_resting,
            "informed": informed_for(self._keys),
            "wall_s": round(time.monotonic() - self._began, 3),
            "run_folder": str(self._writer.folder),
            "grid": {
                "reports": poller.counts.reports,
                "strangers": self._record.tracking.strangers,
                "polls": poller.counts.asked,
                "polls_missed": poller.counts.missed,
                "reports_cut": poller.counts.cut,
                "bad_frames": poller.counts.bad_frames,
                "modules_failed": self._record.failed_modules(poller.silent),
                "kilodat": str(self._record.kilodat),
            },
        }
