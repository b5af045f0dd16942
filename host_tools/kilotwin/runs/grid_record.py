"""The files that a grid adds to a run folder, filled while the run goes on.

tracking.arrows   a row per report of a robot that the host fetched   (Arrow IPC stream)
can.log           every CAN frame, as candump -L writes them
RUN.kilodat       the reports as the lab's own tool writes them, beside the run folder RUN

Events go to events.jsonl with the robots'.
"""

import contextlib
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.grid_layout import Module
from kilotwin.runs.causes import causes, said
from kilotwin.runs.columns import TRACKING_SCHEMA
from kilotwin.runs.event_places import FIELDS
from kilotwin.runs.folder import CAN_LOG, FAILURES, TRACKING, UNDEFINED
from kilotwin.runs.tracking import Tracking
from kilotwin.runs.writer import RunWriter, Stream
from kilotwin.table.grid import kilodat
from kilotwin.table.grid.can_log import CanLog
from kilotwin.table.grid.poller import Reports
from kilotwin.units import seconds, ticks

# A kill costs no more than this much wall time.
_FLUSH_S = 0.5


class GridEvents:
    """Listens to a conductor: what happened, and which modules failed. Writes nothing."""

    def __init__(self) -> None:
        self.log: CanLog | None = None
        self.kilodat: Path | None = None
        self._crashed: list[dict[str, Any]] = []
        self._undefined: list[Mapping[str, Any]] = []

    def reports(self, reports: Reports) -> None:
        """Takes reports of robots."""

    def event(self, time_s: float, kind: str, text: str, **more: Any) -> None:
        """Events."""

    def module_event(self, event: Mapping[str, Any]) -> None:
        """Takes an event of a module's program, which its caller writes down."""
        if event["kind"] in FAILURES:
            row = {"module": list(event["module"]), "tick": event["tick"], "what": said(event)}
            self._crashed.append({**row, **{key: event[key] for key in FIELDS if key in event}})

        elif event["kind"] == UNDEFINED:
            self._undefined.append(event)

    def undefined(self) -> list[dict[str, Any]]:
        """Causes of undefined behaviour in modules, where programs look for it."""
        return [cause.as_dict("module") for cause in causes(self._undefined)]

    def failed_modules(self, silent: Sequence[Module]) -> list[dict[str, Any]]:
        """Modules whose programs failed, and those that do not answer."""
        gone = [{"module": list(module), "what": "does not answer"} for module in silent]
        return [*self._crashed, *gone]

    def flush(self, *, now: bool = False) -> None:
        """Hands everything to the system, if it is time to, or `now`."""

    def close(self) -> None:
        """Ends the files."""


class GridMemory(GridEvents):
    """Keeps what a conductor reports, for `World`."""

    def __init__(self, experiment: Experiment) -> None:
        super().__init__()
        self._experiment = experiment
        self._tracking: Tracking | None = None
        self._rows: list[dict[str, Any]] = []
        self.happened: list[dict[str, Any]] = []

    def reports(self, reports: Reports) -> None:
        """Keeps reports of robots."""
        plan = self._experiment.plan
        assert plan is not None
        if self._tracking is None:
            experiment = self._experiment
            self._tracking = Tracking(experiment, plan.layout, plan.site_maps)
        self._rows += self._tracking.add(reports).to_pylist()

    def event(self, time_s: float, kind: str, text: str, **more: Any) -> None:
        """Keeps what happened."""
        self.happened.append({"time_s": time_s, "kind": kind, "text": text, **more})

    def module_event(self, event: Mapping[str, Any]) -> None:
        """The same, of a module's program."""
        super().module_event(event)
        time_s = seconds(event["tick"])
        more = {key: event[key] for key in FIELDS if key in event}
        self.event(time_s, event["kind"], event["text"], module=list(event["module"]), **more)

    def rows(self) -> list[dict[str, Any]]:
        """The reports so far."""
        return list(self._rows)


class GridRecord(GridEvents):
    """Writes what a conductor reports into the run folder."""

    def __init__(
        self, writer: RunWriter, experiment: Experiment, buses: Sequence[str], zero_s: float
    ) -> None:
        """In the folder of `writer`, which is closed by its owner. `zero_s` is t = 0 in can.log."""
        super().__init__()
        plan = experiment.plan
        assert plan is not None
        self._writer = writer
        self.tracking = Tracking(experiment, plan.layout, plan.site_maps)
        folder = writer.folder
        self._stream = Stream(folder / f"{TRACKING}.arrows", TRACKING_SCHEMA)
        self._waiting: list[Reports] = []
        if experiment.keys.record.can_log:
            self.log = CanLog(folder / CAN_LOG, buses, zero_s=zero_s)
        # Files that an earlier run of that name left beside its folder are not lost.
        file = _free(folder.with_name(f"{folder.name}.kilodat"))
        self._kilodat = kilodat.Writer(file, plan.serials)
        self.kilodat = file
        self._flushed_at = time.monotonic()

    def reports(self, reports: Reports) -> None:
        """Keeps reports until the next flush: rows by the hundred cost less."""
        self._waiting.append(reports)

    def event(self, time_s: float, kind: str, text: str, **more: Any) -> None:
        """Writes what happened, at once."""
        event = {"time_s": round(time_s, 3), "tick": ticks(time_s), "kind": kind, "text": text}
        self._writer.add_event({**event, **more})

    def flush(self, *, now: bool = False) -> None:
        """Hands everything to the system, if it is time to."""
        if not now and time.monotonic() - self._flushed_at < _FLUSH_S:
            return
        self._flushed_at = time.monotonic()
        if self._waiting:
            reports = Reports.joined(self._waiting)
            self._waiting = []
            self._stream.write(self.tracking.add(reports))
            self._kilodat.add(reports)
        if self.log is not None:
            self.log.flush()
        self._kilodat.flush()

    def close(self) -> None:
        """Ends the files."""
        self.flush(now=True)
        self._stream.close()
        self._kilodat.close()
        if self.log is not None:
            self.log.close()

    def give_up(self) -> None:
        """Closes the files as they are: where they lie cannot be written."""
        self._waiting = []
        if self.log is not None:
            self.log.forget()
        for file in (self._stream, self._kilodat, self.log):
            with contextlib.suppress(OSError):
                if file is not None:
                    file.close()


def _free(file: Path) -> Path:
    """That name, or one like it if there is such a file."""
    copy = 1
    free = file
    while free.exists():
        copy += 1
        free = file.with_name(f"{file.stem}-{copy}{file.suffix}")
    return free
