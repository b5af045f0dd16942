"""`kilotwin check`: all that a lab's CI asks of a program, in one report."""

import contextlib
import re
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from kilotwin.errors import InputError, KilotwinError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.programs import Program, ProgramError, find_program
from kilotwin.experiment.text import Setting
from kilotwin.files.junit import Case, Suite
from kilotwin.files.sarif import Result
from kilotwin.programs.cache import Notify
from kilotwin.programs.image.image import build_image
from kilotwin.programs.native.guest import build
from kilotwin.programs.port.check import Report
from kilotwin.programs.port.check import check as port
from kilotwin.programs.port.findings import Finding, Weight
from kilotwin.programs.port.trial import Trial
from kilotwin.studies.pool.places import Processes
from kilotwin.studies.scenario.judge import ScenarioVerdict
from kilotwin.studies.scenario.runner import Scenario, is_scenario, prepare, run_all
from kilotwin.studies.sweep.runner import Display

# As gcc, clang and avr-gcc write them.
_COMPLAINT = re.compile(r"^(.+?):(\d+):(?:\d+:)? (?:fatal )?(error|warning): (.*)$", re.MULTILINE)

_LINE = re.compile(r"^(.+?):(\d+): ")

Level = Literal["error", "warning", "note"]


@dataclass(frozen=True)
class Budget:
    """The most bytes that a program may take; None where any that fits will do."""

    flash: int | None = None
    ram: int | None = None
    stack: int | None = None


@dataclass(frozen=True)
class How:
    """Rules that programs are held against. `tasks`: scenarios in which the program takes the place
    of their robots' own; none: those beside it."""

    include: Sequence[str]
    define: Sequence[str]
    budget: Budget
    trial: Trial
    tasks: Sequence[Path]
    timeout_s: float
    processes: Processes


@dataclass(frozen=True)
class Found:
    """Something that a step found. `level` error: the check fails."""

    rule: str
    level: Level
    message: str
    file: str | None = None
    line: int | None = None

    def text(self) -> str:
        """For people."""
        where = "" if self.file is None else f"{self.file}:"
        where += "" if self.line is None else f"{self.line}:"
        return f"{where} {self.level}: {self.message} [{self.rule}]".lstrip()

    def result(self) -> Result:
        """For SARIF."""
        return Result(self.rule, self.level, self.message, self.file, self.line)


@dataclass
class Step:
    """One of the things that are looked at, and what was found."""

    name: str
    said: str = ""
    found: list[Found] = field(default_factory=list)

    @property
    def fails(self) -> bool:
        """Whether one of them is an error."""
        return any(one.level == "error" for one in self.found)

    def text(self) -> str:
        """A row, and what was found below it."""
        state = "FAIL" if self.fails else "ok  "
        rows = [f"{state}  {self.name:<10}  {self.said}".rstrip()]
        for one in self.found:
            rows += [f"      {line}" for line in one.text().splitlines()]
        return "\n".join(rows)

    def suite(self) -> Suite:
        """For JUnit: a case for each finding, or one that passed."""
        cases = [
            Case(
                f"{one.rule}: {one.message}".splitlines()[0],
                one.message if one.level == "error" else "",
                one.text(),
                one.file or "",
                one.line,
            )
            for one in self.found
        ]
        return Suite(f"check {self.name}", cases or [Case(self.said or self.name)])

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        found = [dict(vars(one)) for one in self.found]
        return {"step": self.name, "fails": self.fails, "said": self.said, "found": found}


def steps(written: Sequence[str], how: How, display: Display, notify: Notify) -> Iterator[Step]:
    """All that is looked at, in its order; InputError if the program is not there."""
    program = program_of(written, how.include, how.define)
    built = on_this_computer(program, notify)
    yield built
    port_step, report = on_the_chip(written, how.include, how.define, how.trial, notify)
    yield port_step
    if report is not None:
        yield size(report, how.budget)
    if built.fails:
        return
    scenarios: list[Scenario] = []
    if how.tasks:
        for file in how.tasks:
            scenarios += prepare([file], [_in_place(file, program)], how.timeout_s, notify)
    else:
        files, unfit = scenarios_beside(program)
        yield from unfit
        scenarios = prepare(files, [], how.timeout_s, notify)
    if scenarios:
        yield from map(of_scenario, run_all(scenarios, how.processes, display))


def _in_place(file: Path, program: Program) -> Setting:
    """The setting that gives a scenario's first robots this program."""
    with contextlib.suppress(OSError, ValueError):
        tables = tomllib.loads(file.read_text(encoding="utf-8"))
        keys = ("robots", "0", "program") if "robots" in tables else ("swarm", "program")
        return Setting(keys, str(program.path.resolve()), f"--scenarios {file}")
    raise InputError(f"--scenarios {file}: cannot be read; name an experiment with [[expect]]")


def program_of(written: Sequence[str], include: Sequence[str], define: Sequence[str]) -> Program:
    """The program; InputError if it is not there."""
    try:
        return find_program(written, Path.cwd(), include, define)
    except ProgramError as error:
        raise InputError(str(error)) from None


def on_this_computer(program: Program, notify: Notify) -> Step:
    """Whether it builds here."""
    step = Step("build", "for this computer")
    try:
        build(program, notify)
    except KilotwinError as error:
        step.found += _complaints("compile", error)
        return step
    step.found += _warnings(program, notify)
    if step.found:
        step.said += f", {len(step.found)} of the compiler's warnings"
    return step


def _warnings(program: Program, notify: Notify) -> Iterator[Found]:
    """Those of avr-gcc about the program's own files; none where that does not compile it, which
    the next step says."""
    said = ""
    with contextlib.suppress(KilotwinError):
        said = "\n".join(build_image(program, notify).warnings)
    for file, line, _, message in _COMPLAINT.findall(said):
        yield Found("compile", "warning", message, file, int(line))


def on_the_chip(
    written: Sequence[str],
    include: Sequence[str],
    define: Sequence[str],
    trial: Trial,
    notify: Notify,
) -> tuple[Step, Report | None]:
    """Findings of what would go wrong on an ATmega328P, as `kilotwin port` says it."""
    step = Step("port", "on an ATmega328P")
    try:
        report = port(written, include, define, trial, notify)
    except KilotwinError as error:
        step.found += _complaints("compile-avr", error)
        return step, None
    step.found += [_of_port(finding) for finding in report.findings]
    return step, report


def size(report: Report, budget: Budget) -> Step:
    """The parts that it takes of the chip, and of its budget."""
    stack = report.stack.bytes
    taken = {"flash": report.flash_bytes, "ram": report.ram_bytes, "stack": stack}
    shown = "no bound" if stack is None else f"{stack:,}"
    step = Step(
        "size", f"flash {report.flash_bytes:,}, RAM {report.ram_bytes:,}, stack {shown} bytes"
    )
    for what, most in vars(budget).items():
        bytes_ = taken[what]
        if most is None:
            continue
        if bytes_ is None:
            step.found.append(
                Found(f"size-{what}", "error", f"no bound is known: {report.stack.why}")
            )
        elif bytes_ > most:
            over = (
                f"{what} takes {bytes_:,} bytes, {bytes_ - most:,} more than the budget of {most:,}"
            )
            step.found.append(Found(f"size-{what}", "error", over))
    return step


def scenarios_beside(program: Program) -> tuple[list[Path], list[Step]]:
    """Scenario files in its folder, and below, whose robots run it; a failed step for each that
    cannot be used."""
    folder = program.path if program.path.is_dir() else program.path.parent
    sources = set(program.sources)
    files, unfit = [], []
    for file in sorted(folder.rglob("*.toml")):
        if not is_scenario(file) or _hidden(file.relative_to(folder)):
            continue
        try:
            groups = Experiment.load(file).groups
        except InputError as error:
            where = _LINE.match(str(error))
            named = (where[1], int(where[2])) if where else (str(file), None)
            unfit.append(Step("scenario", "", [Found("scenario", "error", str(error), *named)]))
            continue
        if any(sources & set(group.program.sources) for group in groups):
            files.append(file)
    return files, unfit


def _hidden(file: Path) -> bool:
    return any(part.startswith(".") or part in ("runs", "build") for part in file.parts[:-1])


def of_scenario(scenario: Scenario) -> Step:
    """The steps that were not met."""
    met = len(scenario.verdicts) - len(scenario.failures)
    said = f"{scenario.name}: {met} of {len(scenario.verdicts)} met"
    found = [one for verdict in scenario.failures for one in _of_verdict(verdict)]
    return Step("scenario", said, found)


def _of_verdict(verdict: ScenarioVerdict) -> list[Found]:
    """Failures of programs at their lines; else the expectation, at its own."""
    file, _, line = verdict.where.rpartition(":")
    where = (file, int(line)) if line.isdigit() else (verdict.where, None)
    if not any(one.file for one in verdict.blamed):
        said = f"{verdict.expected}: {verdict.said}"
        return [Found("scenario", "error", said, *where)]
    return [
        Found("scenario", "error", f"{one.who}: {one.what}", *placed)
        for one in verdict.blamed
        for placed in [(one.file, one.line) if one.file else where]
    ]


def _of_port(finding: Finding) -> Found:
    level: Level = "error" if finding.weight is Weight.FAILS else "warning"
    place = finding.place
    message = f"{finding.what}; {finding.do}"
    if place is None:
        return Found(finding.check, level, message)
    return Found(finding.check, level, message, place.file, place.line)


def _complaints(rule: str, error: KilotwinError) -> Iterator[Found]:
    """The compiler's errors, each with its line; the error's own words where it has none."""
    found = False
    for file, line, kind, message in _COMPLAINT.findall(error.detail):
        if kind == "error":
            found = True
            yield Found(rule, "error", message, file, int(line))
    if not found:
        yield Found(rule, "error", f"{error}\n{error.detail}".strip())
