"""Lines that have run of a native program's sources, by calls at the begins of its basic blocks.

A line has run if a block has that has an instruction of it. Programs that are covered are compiled
without optimisation, so that each block has the lines that are written there.
"""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path

from elftools.elf.elffile import ELFFile

from kilotwin.experiment.programs import Program
from kilotwin.programs.code_places import own_folders
from kilotwin.programs.coverage.lines import Source, Sources
from kilotwin.programs.coverage.marks import Marks
from kilotwin.programs.line_table import LineTable
from kilotwin.programs.linking import ENGLISH
from kilotwin.programs.native.guest import run_tool

_FUNCTION = re.compile(r"^[0-9a-f]+ <")
_INSTRUCTION = re.compile(r"^ *([0-9a-f]+):\t(\S+)(.*)")
_CALL_AT_BEGIN = "<__sanitizer_cov_trace_pc>"

Block = tuple[int, int, int]
"""The address that the call at its begin returns to, its first, and the address behind it."""


def native_sources_of(program: Program, guest: Path, marks: Marks) -> Sources:
    """The program's own files, headers among them, that have instructions; by path, in order. They
    have no branches: a block can be come to by several ways."""
    listing = run_tool(
        ["objdump", "-d", "--no-show-raw-insn", str(guest)], "objdump does not start", ENGLISH
    )
    with guest.open("rb") as stream:
        table = LineTable(ELFFile(stream).get_dwarf_info())
    own = own_folders(program)
    found: Sources = defaultdict(Source)
    for mark, first, end in blocks(listing.splitlines()):
        for row in table.ending_behind(first):
            if row.first >= end:
                break
            if any(row.file.is_relative_to(folder) for folder in own):
                lines = found[row.file].lines
                lines[row.line] = lines.get(row.line, False) or mark in marks
    return dict(sorted(found.items()))


def blocks(listing: Iterable[str]) -> Iterator[Block]:
    """Blocks of objdump's disassembly that begin with the call; the first of a function has what
    lies before its call too. Code behind a jump that does not begin so is left out."""
    first: int | None = None
    mark: int | None = None
    called, at_begin = False, True
    for row in listing:
        if _FUNCTION.match(row):
            first = mark = None
            called, at_begin = False, True
        matched = _INSTRUCTION.match(row)
        if matched is None:
            continue
        address, name, rest = int(matched[1], 16), matched[2], matched[3]
        if called:  # the call before returns to this instruction
            mark, called = address, False
        if name.startswith("call") and _CALL_AT_BEGIN in rest:
            if mark is not None and first is not None:
                yield mark, first, address
            if first is None or not at_begin:
                first = address
            mark, called, at_begin = None, True, False
            continue
        first = address if first is None else first
        if name.startswith(("j", "ret")):
            if mark is not None:
                yield mark, first, address + 1
            first = mark = None
            at_begin = False
