"""Programs of which a simulator gets another half: `#ifdef SIMULATION` and its fellows.

What was seen in the simulator then says nothing about the lines that only the robot has, and the
other way about.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from kilotwin.experiment.programs import Program
from kilotwin.programs.port.disassembly import Place
from kilotwin.programs.port.findings import Finding, Weight

# Macros that say that a simulator executes the program.
_SIMULATORS = re.compile(r"\b(\w*SIMULAT\w*|SIM|\w+_SIM|ARGOS\w*|KILOMBO\w*)\b")
_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
_DIRECTIVE = re.compile(r"^\s*#\s*(ifdef|ifndef|if|elif|else|endif|define|undef)\b\s*(.*)$")
_SIMULATED, _ROBOTS = "simulated", "robot's"


@dataclass
class _Open:
    """A conditional that is being read; `half` None: it does not ask for a simulator."""

    half: str | None = None


@dataclass
class _Halves:
    """Lines of code that only one half has, of one macro."""

    places: list[Place] = field(default_factory=list)
    lines: dict[str, int] = field(default_factory=lambda: {_SIMULATED: 0, _ROBOTS: 0})


def two_programs(program: Program) -> Iterator[Finding]:
    """Conditionals by which a simulator executes other lines than the robot."""
    found: dict[str, _Halves] = {}
    defined = {define.partition("=")[0] for define in program.defines}
    for source in program.sources:
        _read(source, source.read_text(errors="replace"), found, defined)
    for macro, halves in found.items():
        if any(halves.lines.values()):
            what = _told(macro, halves, is_defined=macro in defined)
            for place in halves.places:
                yield Finding("two-programs", Weight.WARNS, what, _do(macro), place)


def _told(macro: str, halves: _Halves, *, is_defined: bool) -> str:
    simulated, robots = halves.lines[_SIMULATED], halves.lines[_ROBOTS]
    what = f"{macro} makes two programs of one file"
    if is_defined:
        return (
            f"{what}: it is defined here, so that lines that the robot has are left out ({robots}) "
            f"and others are in their place ({simulated})"
        )
    return (
        f"{what}: what was seen in a simulator that defines it comes of other lines ({simulated}) "
        f"than are built here and for the robot ({robots})"
    )


def _do(macro: str) -> str:
    return (
        "let both execute the same lines, which the emulator needs no other half for; `kilotwin "
        f"compare` of runs with and without -D {macro} shows what comes of the difference"
    )


def _read(source: Path, text: str, found: dict[str, _Halves], defined: set[str]) -> None:
    """Counts the lines of both halves; `defined` gets what the file defines itself."""
    plain = _COMMENT.sub(lambda comment: "\n" * comment[0].count("\n"), text)
    open_: list[tuple[str, _Open]] = []
    for number, line in enumerate(plain.split("\n"), 1):
        directive = _DIRECTIVE.match(line)
        if directive is None:
            _count(line, open_, found)
            continue
        word, rest = directive.groups()
        macro = _SIMULATORS.search(rest)
        if word == "define":
            if macro and rest.startswith(macro[1]):
                defined.add(macro[1])
            _count(rest, open_, found)
        elif word in ("if", "ifdef", "ifndef"):
            one = _Open()
            if macro:
                negated = re.search(rf"!\s*(?:defined\s*\(?\s*)?{macro[1]}", rest)
                one.half = _ROBOTS if word == "ifndef" or negated else _SIMULATED
                found.setdefault(macro[1], _Halves()).places.append(Place(str(source), number))
            open_.append((macro[1] if macro else "", one))
        elif word in ("else", "elif") and open_:
            one = open_[-1][1]
            if one.half is not None:
                one.half = _ROBOTS if one.half == _SIMULATED else _SIMULATED
        elif word == "endif" and open_:
            open_.pop()


def _count(line: str, open_: Sequence[tuple[str, _Open]], found: dict[str, _Halves]) -> None:
    if not re.search(r"\w", line) or line.lstrip().startswith("#"):
        return
    for macro, one in open_:
        if one.half is not None:
            found[macro].lines[one.half] += 1
