"""Roles of a program's functions, from its source: callbacks do not show in its machine code.

Read after the preprocessor, with its line marks, so that macros are seen through and places are
those of the file as it was written.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from kilotwin.experiment.programs import Program
from kilotwin.programs.image.image import program_flags
from kilotwin.programs.image.tools import avr_gcc
from kilotwin.programs.native.guest import run_tool
from kilotwin.programs.port.disassembly import Place

_MARK = re.compile(r'^# (\d+) "([^"]*)"')
# The second name is that of the Kilogrid's helpers.
_CALLBACK = re.compile(
    r"\b(?:kilo|utils)_message_(rx|tx|tx_success)\s*=\s*(?:\([\w\s*]+\)\s*)?&?\s*(\w+)"
)
_START = re.compile(
    r"\bkilo_start\s*\(\s*(?:\([\w\s*]+\)\s*)?&?\s*(\w+)\s*,\s*"
    r"(?:\([\w\s*]+\)\s*)?&?\s*(\w+)\s*\)"
)


@dataclass(frozen=True)
class Line:
    """A line of the program's own source, after the preprocessor."""

    place: Place
    text: str


@dataclass(frozen=True)
class Roles:
    """Functions by their part; `callbacks`: by `rx`, `tx`, `tx_success`, and where they are set."""

    setup: frozenset[str]
    loop: frozenset[str]
    callbacks: dict[str, dict[str, Place]]

    @property
    def in_interrupts(self) -> frozenset[str]:
        """The program's functions that interrupts call."""
        return frozenset(name for found in self.callbacks.values() for name in found)

    @property
    def in_main(self) -> frozenset[str]:
        """Those that run outside of them."""
        return frozenset({"main"}) | self.setup | self.loop


def own_lines(program: Program) -> list[Line]:
    """All lines of the program's sources and own headers, without comments, macros expanded."""
    compiler = avr_gcc()
    folders = [source.parent for source in program.sources] + list(program.include_folders)
    found = []
    for source in program.sources:
        words = [compiler, *program_flags(program), "-w", "-E", str(source)]
        text = run_tool(words, str(source), confine=True)
        for line in _marked(text):
            if any(line.place.file.startswith(f"{folder}/") for folder in folders):
                found.append(line)
    return found


def _marked(text: str) -> Iterator[Line]:
    file, number = "", 0
    for line in text.split("\n"):
        if mark := _MARK.match(line):
            number, file = int(mark[1]), mark[2]
        else:
            if line.strip():
                yield Line(Place(file, number), line)
            number += 1


def find_roles(lines: list[Line]) -> Roles:
    """The functions registered as callbacks, by role."""
    callbacks: dict[str, dict[str, Place]] = {"rx": {}, "tx": {}, "tx_success": {}}
    setup, loop = set(), set()
    for line in lines:
        for kind, name in _CALLBACK.findall(line.text):
            callbacks[kind].setdefault(name, line.place)
    # A call may go over several lines.
    for first, second in _START.findall(" ".join(line.text for line in lines)):
        setup.add(first)
        loop.add(second)
    return Roles(frozenset(setup), frozenset(loop), callbacks)
