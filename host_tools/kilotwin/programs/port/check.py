"""`kilotwin port`: will a program run on the robot as it does here?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kilotwin.errors import InputError
from kilotwin.experiment.programs import Api, ProgramError, find_program
from kilotwin.programs.cache import Notify
from kilotwin.programs.image.image import Image, build_image
from kilotwin.programs.image.image_size import FLASH_BYTES, RAM_BYTES
from kilotwin.programs.native.guest import build as build_guest
from kilotwin.programs.port import (
    bounds,
    callbacks,
    draws,
    halves,
    machine_code,
    numbers,
    retrial,
    source_text,
)
from kilotwin.programs.port import trial as trials
from kilotwin.programs.port.disassembly import Disassembly
from kilotwin.programs.port.findings import Finding, Weight, in_order
from kilotwin.programs.port.retrial import Tried
from kilotwin.programs.port.roles import find_roles, own_lines
from kilotwin.programs.port.stack import StackBound, bound
from kilotwin.programs.port.trial import Outcome, Trial
from kilotwin.programs.port.twin import TWIN_S, differing_ear

_SHOWN_CHAIN = 120


@dataclass(frozen=True)
class Report:
    """The findings on one program, the worst first."""

    program: str
    flash_bytes: int
    ram_bytes: int
    stack: StackBound
    trial: Outcome | None
    """None: it was not run."""
    findings: tuple[Finding, ...]

    @property
    def fails(self) -> bool:
        """Whether it would fail on the robot."""
        return any(finding.weight is Weight.FAILS for finding in self.findings)

    def as_dict(self) -> dict[str, Any]:
        """The --json object."""
        return {
            "program": self.program,
            "fails": self.fails,
            "flash_bytes": self.flash_bytes,
            "flash_budget_bytes": FLASH_BYTES,
            "ram_bytes": self.ram_bytes,
            "ram_budget_bytes": RAM_BYTES,
            "stack_bound_bytes": self.stack.bytes,
            "stack_bound_by": self.stack.why,
            "trial": self.trial.as_dict() if self.trial else None,
            "findings": [finding.as_dict() for finding in self.findings],
        }

    def text(self) -> str:
        """For people."""
        stack = "no bound" if self.stack.bytes is None else f"{self.stack.bytes:,} bytes at most"
        why = self.stack.why
        lines = [
            f"{self.program}, on an ATmega328P:",
            f"  flash  {self.flash_bytes:6,} of {FLASH_BYTES:,} bytes",
            f"  RAM    {self.ram_bytes:6,} of {RAM_BYTES:,} bytes of variables",
            f"  stack  {stack} ({why if len(why) <= _SHOWN_CHAIN else why[:_SHOWN_CHAIN] + '...'})",
            *(self.trial.lines() if self.trial else ()),
            "",
            *(finding.text() for finding in self.findings),
        ]
        if self.findings:
            lines.append("docs/porting.md has each finding by its name in brackets, with good code")
        else:
            lines.append("nothing found that would go wrong on the robot")
        return "\n".join(lines)


def check(
    written: Sequence[str],
    include: Sequence[str],
    define: Sequence[str],
    trial: Trial | None,
    notify: Notify,
    *,
    api: Api | None = None,
) -> Report:
    """Builds the program for the robot and looks for what goes wrong there, in a `trial` too.

    Of a module's program (`api`) it knows the size alone.
    """
    try:
        program = find_program(written, Path.cwd(), include, define, api)
    except ProgramError as error:
        raise InputError(str(error)) from None
    image = build_image(program, notify)
    code = Disassembly.of(image)
    lines = own_lines(program)
    roles = find_roles(lines)
    stack = bound(code, roles)
    if program.target == "module":
        sizes = [*machine_code.size(code, stack), *machine_code.scant_memory(code, lines)]
        found = in_order([*sizes, *halves.two_programs(program)])
        return Report(program.name, code.flash_bytes, code.ram_bytes, stack, None, found)
    # The API's own code is not the program's to mend.
    own = {line.place.file for line in lines}
    outcome, of_run = None, list[Finding]()
    if trial is not None and "kilo_start" not in code.functions:
        notify("no trial: the program never calls kilo_start()")
    elif trial is not None:
        tried = Tried(program, code, roles, trial)
        outcome, of_run = _tried(tried, image, own, notify)
    silent = {name for name in roles.callbacks["tx"] if machine_code.sends_nothing(code, name)}
    findings = [
        *machine_code.size(code, stack),
        *machine_code.scant_memory(code, lines),
        *machine_code.interrupts(code, roles),
        *machine_code.torn(code, roles),
        *callbacks.before_setup(code, roles),
        *callbacks.messages(code, roles, lines),
        *source_text.ticks(lines, outcome),
        *draws.draws(program, lines),
        *source_text.motors(lines, outcome),
        *source_text.checksum(lines, roles, silent, outcome),
        *source_text.widths(program),
        *source_text.missing_returns(image.warnings),
        *source_text.shifts(lines),
        *source_text.joined_bytes(lines),
        *halves.two_programs(program),
    ]
    theirs = [found for found in findings if found.place is None or found.place.file in own]
    theirs += of_run
    return Report(program.name, code.flash_bytes, code.ram_bytes, stack, outcome, in_order(theirs))


def _tried(
    tried: Tried, image: Image, own: set[str], notify: Notify
) -> tuple[Outcome, list[Finding]]:
    """The outcome of a run on the chip and here, and what was found in it."""
    program, code, trial = tried.program, tried.code, tried.trial
    guest = build_guest(bounds.watched(program), notify, flags=bounds.FLAGS)
    notify(f"running {program.written} for {trial.seconds:g} s on an ATmega328P and here")
    sums = numbers.sums(code, own)
    watched = [(one.at, one.carry) for one in sums]
    outcome = trials.run(trial, guest, image, code, tried.roles, sums=watched)
    unfit = [*numbers.seen_unfit(tried, guest, sums, outcome.carried, notify)]
    differs = [*retrial.findings(tried, outcome, unfit, notify)]
    if outcome.difference is None and (ear := differing_ear(program)):
        # A twin has seen it decide otherwise with these.
        notify(f"running it again: with the messages that robot {ear.uid} of a run got")
        led = replace(tried, trial=Trial(TWIN_S, trial.seed, ear))
        other = trials.run(led.trial, guest, image, code, tried.roles)
        differs = [*retrial.findings(led, other, unfit, notify)]
    return outcome, [*trials.findings(outcome), *unfit, *differs]
