"""The modules of a grid flashed over CAN: find, send, ask, start, see that they answer again.

Whatever ends it, the last line says what the modules hold and what to type next.
"""

import shlex
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from kilotwin.errors import DeviceError, InterruptError, RunError
from kilotwin.experiment.spec.grid_layout import Layout, Module
from kilotwin.files.flash_image import FlashImage
from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.table.flash.module_laps import ModuleLaps
from kilotwin.table.flash.module_rounds import Round, call, old_lap
from kilotwin.table.flash.modules_table import ModulesTable
from kilotwin.table.flash.progress import Progress
from kilotwin.units import counted, duration_text

# A program answers nothing for so long after its start.
_START_S = 1.5
_STARTS = 3
_SHOWN_S = 2.0


class Result(StrEnum):
    """Result of a module; the first five as `Fate` has them."""

    VERIFIED = "verified"
    INCOMPLETE = "incomplete"
    WRONG = "wrong"
    LOST = "lost"
    MUTE = "mute"
    SENT = "sent"
    REFUSED = "refused"
    UNREACHED = "unreached"


_TEXTS = {
    Result.VERIFIED: "has the program",
    Result.INCOMPLETE: "has a part of the program and waits in its boot loader",
    Result.WRONG: "has all pages, and its boot loader cannot start them",
    Result.LOST: "has stopped answering; is it switched on?",
    Result.MUTE: "answers nothing; is it switched on?",
    Result.SENT: "was sent the program; its boot loader cannot tell whether it has it",
    Result.REFUSED: "does not enter its boot loader; it runs what it had",
    Result.UNREACHED: "is on a bus that does not work",
}


@dataclass(frozen=True)
class Job:
    """A flash that is wanted."""

    image: FlashImage
    name: str
    """The program's, for people."""
    modules: Sequence[Module] = ()
    """Those to flash; none: all that are found."""
    expect_all: bool = False
    """Whether the grid has a module at every place."""
    old_loader: bool = False
    """Whether it is known that their boot loaders are original ones."""
    again: Sequence[str] = ()
    """The command that was typed."""


@dataclass(frozen=True)
class ModuleOutcome:
    """One module, when all is over."""

    module: Module
    result: Result
    answers: bool
    """Whether it answers a poll, as programs do."""
    missing_pages: int = 0
    had_it: bool = False

    @property
    def failed(self) -> bool:
        """Whether it is among those that exit code 4 is for."""
        return self.result not in (Result.VERIFIED, Result.SENT) or not self.answers

    def text(self) -> str:
        """One line."""
        x, y = self.module
        text = f"module {x}-{y} {_TEXTS[self.result]}"
        if self.missing_pages and self.result in (Result.INCOMPLETE, Result.LOST):
            text += f"; it lacks {counted(self.missing_pages, 'page')}"
        if self.result in (Result.VERIFIED, Result.SENT) and not self.answers:
            text += ", and has not answered since"
        return text

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        return {
            "module": list(self.module),
            "result": str(self.result),
            "answers": self.answers,
            "missing_pages": self.missing_pages,
            "had_it": self.had_it,
        }


@dataclass
class Outcome:
    """How far it came."""

    job: Job
    layout: Layout
    modules: list[ModuleOutcome] = field(default_factory=list)
    down: str = ""
    """The buses that do not work, and why."""
    empty: int = 0
    """Places without a module that answers, where none was expected."""
    laps: int = 0
    pages_sent: int = 0

    @property
    def failed(self) -> list[ModuleOutcome]:
        """Modules that did not come through."""
        return [module for module in self.modules if module.failed]

    @property
    def well(self) -> bool:
        """Whether all that could be seen is as it should be."""
        return not self.failed and not self.down

    def as_dict(self) -> dict[str, Any]:
        """The --json object."""
        image = self.job.image
        return {
            "program": self.job.name,
            "pages": len(image.pages),
            "image": f"{image.image_id:08X}",
            "build": str(image.build_id) if image.build_id else None,
            "laps": self.laps,
            "pages_sent": self.pages_sent,
            "modules": [module.as_dict() for module in self.modules],
            "failed": [list(module.module) for module in self.failed],
            "empty_places": self.empty,
            "buses_down": self.down or None,
        }

    def text(self) -> str:
        """A map, the sum, and a line for each module that failed."""
        count = self._count
        verified, sent = count(Result.VERIFIED), count(Result.SENT)
        had = sum(module.had_it for module in self.modules)
        lines = [*self._map(), f"{self.job.name}: {self._image_text()}"]
        if verified:
            already = f", {had} of them before" if had else ""
            again = f"; {self._laps_text()}" if self.laps else ""
            lines.append(f"verified (v): {verified} of {len(self.modules)} modules{already}{again}")
        if sent:
            what = "sent (s), not verifiable, since their boot loaders are original ones"
            back = sum(m.answers for m in self.modules if m.result is Result.SENT)
            lines.append(f"{what}: {sent} modules; {back} of them answer polls again")
        lines += [f"failed (x): {module.text()}" for module in self.failed]
        if self.down:
            lines.append(f"of the buses these do not work: {self.down}; see to them, type it again")
        if self.empty:
            lines.append(
                f"nothing answers at {self.empty} other places (-); name modules that should be "
                "there by --size or --module"
            )
        return "\n".join(lines)

    def _image_text(self) -> str:
        image = self.job.image
        return f"{counted(len(image.pages), 'page')}, image {image.image_id:08X}"

    def _laps_text(self) -> str:
        again = self.pages_sent - len(self.job.image.pages)
        laps = f"{self.laps} laps" if self.laps > 1 else "1 lap"
        return f"{laps}, {again} pages of them sent again" if again > 0 else laps

    def _count(self, result: Result) -> int:
        return sum(module.result is result for module in self.modules)

    def _map(self) -> list[str]:
        marks = {module.module: _mark(module) for module in self.modules}
        others = self.job.modules
        columns, rows = range(self.layout.columns), range(self.layout.rows)
        blank = "." if others else "-"
        lines = [f"{y:2} " + " ".join(marks.get((x, y), blank) for x in columns) for y in rows]
        return [*reversed(lines), "   " + " ".join(str(x % 10) for x in columns)]


def _mark(module: ModuleOutcome) -> str:
    return "x" if module.failed else "s" if module.result is Result.SENT else "v"


class ModulesFlasher:
    """One flash of a grid's modules."""

    def __init__(self, job: Job, table: ModulesTable, progress: Progress) -> None:
        self._job, self._table, self._progress = job, table, progress
        self._inbox = table.inbox
        self._layout = table.layout
        wanted = set(job.modules or self._layout.modules())
        self._spared = [m for m in self._layout.modules() if m not in wanted]
        self._laps = ModuleLaps(job.image, self._layout, sorted(wanted), self._spared)
        self._told = ""
        self._interrupts = 0
        self._delicate = False

    def flash(self) -> Outcome:
        """All of it.

        DeviceError: no bus works any more, or no module is there; InterruptError: Ctrl-C;
        RunError: another host sends programs. They say how far it came.
        """
        with heeding_interrupts(lambda *_: self._interrupt()):
            before = self._answering("looking for modules")
            if not self._job.old_loader:
                while (round_ := self._laps.next_round()) is not None:
                    self._send(round_)
            expected = self._expected(before)
            original, refused = self._find_originals(before, expected)
            after = self._start_verified()
            if original:
                self._send_old(original)
                after = self._answering("seeing which answer again")
            return self._outcome(expected, after, original, refused)

    def _expected(self, before: Collection[Module]) -> list[Module]:
        job = self._job
        if job.modules or job.expect_all:
            expected = set(job.modules or self._layout.modules())
        else:
            mute = set(self._laps.mute)
            expected = {m for m in self._layout.modules() if m in before or m not in mute}
        if not expected:
            self._check()
            raise DeviceError(
                "no module answers; is the table switched on, and is --can right? Name the modules "
                "that are there by --size or --module if they wait in original boot loaders"
            )
        return sorted(expected)

    def _find_originals(
        self, before: Collection[Module], expected: Sequence[Module]
    ) -> tuple[list[Module], list[Module]]:
        """Modules that did not report: those with original loaders, those in no loader."""
        mute = set(self._laps.mute)
        candidates = [module for module in expected if module in mute]
        if not candidates:
            return [], []
        if self._job.old_loader:
            self._send(call("calling the boot loaders", self._layout, candidates))
        running = set(self._answering("looking which run their programs still"))
        refused = [module for module in candidates if module in running]
        return [module for module in candidates if module not in running], refused

    def _start_verified(self) -> list[Module]:
        """Starts the program in modules that have it; returns those that answer then."""
        answering: list[Module] = []
        for _ in range(_STARTS):
            if not set(self._laps.verified) - set(answering):
                break
            self._send(self._laps.start())
            answering = self._answering("seeing which answer again", after_s=_START_S)
        return answering

    def _send_old(self, modules: Sequence[Module]) -> None:
        self._delicate = True
        others = [module for module in self._layout.modules() if module not in self._laps.mute]
        self._send(old_lap(self._job.image, self._layout, modules, [*self._spared, *others]))
        self._delicate = False
        self._interrupts = 0

    def _outcome(
        self,
        expected: Sequence[Module],
        answering: Collection[Module],
        original: Collection[Module],
        refused: Collection[Module],
    ) -> Outcome:
        outcome = Outcome(self._job, self._layout)
        down = self._table.controller.down
        for module in expected:
            result = Result(self._laps.fate(module))
            if result is not Result.VERIFIED and self._layout.bus_of(module) in down:
                result = Result.UNREACHED
            elif module in original:
                result = Result.SENT
            elif module in refused:
                result = Result.REFUSED
            missing, had_it = self._laps.missing(module), self._laps.had_it(module)
            outcome.modules.append(
                ModuleOutcome(module, result, module in answering, missing, had_it)
            )
        outcome.down = self._table.down_text()
        if not self._job.modules:
            outcome.empty = self._layout.columns * self._layout.rows - len(expected)
        outcome.laps, outcome.pages_sent = self._laps.laps, self._laps.pages_sent
        return outcome

    # One order each.

    def _answering(self, text: str, after_s: float = 0.0) -> list[Module]:
        """The modules that answer a poll."""
        self._progress.step(text)
        controller = self._table.controller
        if after_s:
            controller.transmit({}, after_s)
            self._wait()
        controller.look()
        self._wait()
        silent = set(controller.poller.silent)
        return [module for module in self._layout.modules() if module not in silent]

    def _send(self, round_: Round) -> None:
        """Carries a round out, and hands the reports over."""
        left = f", {duration_text(round_.duration_s)}" if round_.duration_s >= _SHOWN_S else ""
        if round_.text != self._told:
            self._told = round_.text
            self._progress.step(f"{round_.text}{left}")
        controller = self._table.controller
        controller.transmit(round_.frames, round_.settle_s)
        self._wait(frames=sum(map(len, round_.frames.values())))
        for module, report in self._inbox.reports:
            self._laps.take(module, report)
        self._inbox.reports.clear()

    def _wait(self, frames: int = 0) -> None:
        shown = 0.0
        total = max(frames, 1)
        controller = self._table.controller

        def ended() -> bool:
            nonlocal shown
            share = 1 - controller.queued / total
            if frames and share > shown + 0.01:
                shown = share
                self._progress.part(share)
            return self._interrupts > self._delicate or self._inbox.stranger

        self._table.wait(ended)
        self._check()

    def _check(self) -> None:
        """Ends it if it cannot go on."""
        if self._interrupts > self._delicate:
            raise InterruptError(f"broken off; {self._state()}")
        if self._inbox.stranger:
            raise RunError(f"another host sends programs to these modules; {self._state()}")
        if len(self._table.controller.down) == self._layout.buses:
            raise DeviceError(f"--can {self._table.down_text()}; {self._state()}")

    def _interrupt(self) -> None:
        self._interrupts += 1
        if self._delicate and self._interrupts == 1:
            self._progress.note(
                "original boot loaders are stuck with half a program; it is nearly done. "
                "Ctrl-C again leaves them so"
            )

    def _state(self) -> str:
        """State of the modules when it has broken off, and the command to type."""
        again = f"type: {shlex.join(self._job.again)}"
        if self._delicate:
            return (
                "modules with original boot loaders have half a program and wait in them: do not "
                f"switch them off, and {again}"
            )
        heard = len(list(self._table.layout.modules())) - len(self._laps.mute) - len(self._spared)
        if not heard:
            return f"no module has been changed; {again}"
        verified = len(self._laps.verified)
        rest = heard - verified
        parts = [f"{verified} modules have the program"] if verified else []
        parts += [f"{rest} modules have a part of it or what they had"] if rest else []
        return f"{', '.join(parts)}, and wait in their boot loaders; to go on {again}"
