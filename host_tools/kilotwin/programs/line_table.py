"""The line table of an ELF file: which line of the sources an address of its code belongs to."""

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path

from elftools.dwarf.compileunit import CompileUnit
from elftools.dwarf.dwarfinfo import DWARFInfo
from elftools.dwarf.lineprogram import LineProgram

# In which files and folders are counted from 0; the folder 0 is that of the compiler.
_FROM_ZERO = 5


@dataclass(frozen=True)
class LineRow:
    """Instructions from `first` up to below `end`, in bytes, of a line; `unit` is the number of the
    compilation unit."""

    first: int
    end: int
    file: Path
    line: int
    unit: int


_END = attrgetter("end")


class LineTable:
    """All rows, in order of addresses."""

    def __init__(self, dwarf: DWARFInfo) -> None:
        self.units: list[CompileUnit] = list(dwarf.iter_CUs())
        self._rows: list[LineRow] = []
        for number, unit in enumerate(self.units):
            program = dwarf.line_program_for_CU(unit)
            if program is not None:
                self._rows += _rows(program, files_of(program), number)
        self._rows.sort(key=_END)

    def ending_behind(self, address: int) -> list[LineRow]:
        """The rows that end behind an address."""
        return self._rows[bisect_right(self._rows, address, key=_END) :]

    def at(self, address: int) -> LineRow | None:
        """That of one instruction."""
        index = bisect_right(self._rows, address, key=_END)
        row = self._rows[index] if index < len(self._rows) else None
        return row if row is not None and row.first <= address else None


def files_of(program: LineProgram) -> dict[int, Path]:
    """Files of a unit by the numbers that its rows and its calls have. Files are compiled by their
    whole paths."""
    folders = [Path(name.decode()) for name in program["include_directory"]]
    since = 0
    if program["version"] < _FROM_ZERO:
        folders, since = [Path(), *folders], 1
    return {
        number: (folders[entry.dir_index] / entry.name.decode()).resolve()
        for number, entry in enumerate(program["file_entry"], since)
    }


def _rows(program: LineProgram, files: dict[int, Path], unit: int) -> Iterator[LineRow]:
    before = None
    for entry in program.get_entries():
        state = entry.state
        if state is None:
            continue
        if before is not None and before.address < state.address and before.line:
            yield LineRow(before.address, state.address, files[before.file], before.line, unit)
        before = None if state.end_sequence else state
