"""Places in a program's sources, by addresses of its code: what a crash is reported with.

By the debug information of the guest, or of the .elf of a program that runs by its machine code.
"""

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from elftools.common.exceptions import DWARFError, ELFError
from elftools.dwarf.compileunit import CompileUnit
from elftools.dwarf.descriptions import describe_form_class
from elftools.dwarf.die import DIE
from elftools.dwarf.dwarfinfo import DWARFInfo
from elftools.dwarf.ranges import BaseAddressEntry
from elftools.elf.elffile import ELFFile

from kilotwin.experiment.programs import Program
from kilotwin.files import resources
from kilotwin.programs.calls import Calls
from kilotwin.programs.line_table import LineTable, files_of
from kilotwin.programs.native.guest import MAIN

_INLINED = "DW_TAG_inlined_subroutine"
_WITH_CODE = ("DW_TAG_subprogram", _INLINED, "DW_TAG_lexical_block")


@dataclass(frozen=True)
class Place:
    """A line of a source file, and the function that it is in, "" where that is not known."""

    file: Path
    line: int
    function: str = ""

    def text(self) -> str:
        """`walk.c:42 in loop()`."""
        function = f" in {self.function}()" if self.function else ""
        return f"{self.file.name}:{self.line}{function}"


def own_folders(program: Program) -> set[Path]:
    """Folders of a program's sources and headers; those of the runtime are none."""
    runtime = resources.path("firmware/kilolib").resolve()
    folders = {source.resolve().parent for source in program.sources}
    folders |= {folder.resolve() for folder in program.include_folders}
    return {folder for folder in folders if not folder.is_relative_to(runtime)}


class CodePlaces:
    """Those of one built program."""

    def __init__(self, content: bytes, program: Program) -> None:
        """`content`: of the file with its debug information (Guest.symbols)."""
        self._content = content
        self._program = program
        self._dwarf: DWARFInfo | None = None

    def of(self, code: Sequence[int]) -> Place | None:
        """That of the first of some addresses (CodePath of emulator/base/events.h) that lies in the
        program's own files; of the first in any, or None, if none does.

        A program can write into its debug information, which may therefore be anything.
        """
        try:
            return self._first_own(code)
        except (ELFError, DWARFError, LookupError, ValueError, TypeError, AttributeError):
            return None
        except (AssertionError, RecursionError, OverflowError):
            return None

    def _first_own(self, code: Sequence[int]) -> Place | None:
        if self._dwarf is None:
            elf = ELFFile(io.BytesIO(self._content))
            self._dwarf, self._calls = elf.get_dwarf_info(), Calls(elf)
            self._table = LineTable(self._dwarf)
        found = []
        own = own_folders(self._program)
        for address in self._real(code):
            for place in self._places(self._dwarf, address):
                if any(place.file.is_relative_to(folder) for folder in own):
                    return place
                found.append(place)
        return found[0] if found else None

    def _real(self, code: Sequence[int]) -> Iterator[int]:
        """The addresses without calls that are over."""
        entry: int | None = None
        for number, address in enumerate(code):
            if number > 0 and not self._calls.leads_to(address, entry):
                continue
            entry = self._calls.entry_of(address)
            yield address

    def _places(self, dwarf: DWARFInfo, address: int) -> Iterator[Place]:
        """Places of an instruction, the innermost first: of one in an inlined function that of its
        call too."""
        row = self._table.at(address)
        if row is None:
            return
        unit = self._table.units[row.unit]
        top = unit.get_top_DIE()
        base = _number(top, "DW_AT_low_pc")
        program = dwarf.line_program_for_CU(unit)
        assert program is not None
        files = files_of(program)
        file, line = row.file, row.line
        for die in reversed(list(_around(dwarf, top, base, address))):
            if die.tag == "DW_TAG_lexical_block":
                continue
            yield Place(file, line, _name(die))
            if die.tag == _INLINED and "DW_AT_call_line" in die.attributes:
                file = files[_number(die, "DW_AT_call_file")]
                line = _number(die, "DW_AT_call_line")
            else:
                return
        yield Place(file, line)


def _around(dwarf: DWARFInfo, die: DIE, base: int, address: int) -> Iterator[DIE]:
    """Functions and blocks that hold an address, the outermost first."""
    for child in die.iter_children():
        if child.tag in _WITH_CODE and _holds(dwarf, child, base, address):
            yield child
            yield from _around(dwarf, child, base, address)
            return


def _holds(dwarf: DWARFInfo, die: DIE, base: int, address: int) -> bool:
    if "DW_AT_low_pc" in die.attributes and "DW_AT_high_pc" in die.attributes:
        low, high = _number(die, "DW_AT_low_pc"), _number(die, "DW_AT_high_pc")
        if describe_form_class(die.attributes["DW_AT_high_pc"].form) == "constant":
            high += low
        return low <= address < high
    lists = dwarf.range_lists()
    if "DW_AT_ranges" not in die.attributes or lists is None:
        return False
    unit = die.cu
    assert isinstance(unit, CompileUnit)
    for entry in lists.get_range_list_at_offset(_number(die, "DW_AT_ranges"), unit):
        if isinstance(entry, BaseAddressEntry):
            base = entry.base_address
            continue
        since = 0 if entry.is_absolute else base
        if since + entry.begin_offset <= address < since + entry.end_offset:
            return True
    return False


def _number(die: DIE, attribute: str) -> int:
    return int(die.attributes[attribute].value) if attribute in die.attributes else 0


def _name(die: DIE) -> str:
    for link in ("DW_AT_abstract_origin", "DW_AT_specification"):
        if link in die.attributes:
            return _name(die.get_DIE_from_attribute(link))
    if "DW_AT_name" not in die.attributes:
        return ""
    name = die.attributes["DW_AT_name"].value.decode(errors="replace")
    return "main" if name == MAIN else str(name)
