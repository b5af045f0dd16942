"""From machine code to lines: what has run of a program's sources, by the ELF's line table.

A line has run if an instruction of it has. A branch is one of the machine code: an `if` with `&&`
has several, and a loop that the compiler laid out in two parts has one more.
"""

from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from operator import itemgetter
from pathlib import Path

from elftools.dwarf.lineprogram import LineProgram
from elftools.elf.elffile import ELFFile

from kilotwin import _emulator
from kilotwin.build.avr import Image
from kilotwin.build.seam import seam_of
from kilotwin.build.translator import Block, blocks_of
from kilotwin.coverage.marks import NOT_TAKEN, RAN, TAKEN, Marks
from kilotwin.experiment.programs import Program
from kilotwin.files import resources

_END = itemgetter(1)  # of a row of the table


@dataclass
class Source:
    """The part of a source file that has run.

    `lines`: by number, whether an instruction of it has run, of lines that have instructions.
    `branches`: by line, of each branch there, in the order of addresses, whether it was taken and
    whether it was not.
    """

    lines: dict[int, bool] = field(default_factory=dict)
    branches: dict[int, list[tuple[bool, bool]]] = field(default_factory=dict)

    @property
    def lines_run(self) -> int:
        """How many lines have run."""
        return sum(self.lines.values())

    @property
    def ways(self) -> list[bool]:
        """Both ways of all branches, whether each was gone."""
        return [way for branches in self.branches.values() for both in branches for way in both]


Sources = dict[Path, Source]


def sources_of(program: Program, image: Image, marks: Marks) -> Sources:
    """The program's own files, headers among them, that have instructions; by path, in order."""
    flash, _ = _emulator.flash_image(str(image.elf))
    blocks = blocks_of(flash, seam_of(image.elf, image.objects("program")))
    of_address = _Lines(image.elf)
    found: Sources = defaultdict(Source)
    branches: dict[tuple[Path, int], list[tuple[bool, bool]]] = defaultdict(list)
    own = _own_folders(program)
    for block in blocks:
        ran = bool(marks.get(block.begin, 0) & RAN)
        for file, line in of_address.of(block):
            if any(file.is_relative_to(folder) for folder in own):
                lines = found[file].lines
                lines[line] = lines.get(line, False) or ran
        if block.branch is not None:
            at = of_address.at(block.branch)
            if at is not None and at[0] in found:
                mark = marks.get(block.branch, 0)
                branches[at].append((bool(mark & TAKEN), bool(mark & NOT_TAKEN)))
    for (file, line), ways in branches.items():
        found[file].branches[line] = ways
    return dict(sorted(found.items()))


def _own_folders(program: Program) -> set[Path]:
    """Folders of its sources and headers; files of the runtime are not looked at."""
    runtime = resources.path("firmware/kilolib").resolve()
    folders = {source.resolve().parent for source in program.sources}
    folders |= {folder.resolve() for folder in program.include_folders}
    return {folder for folder in folders if not folder.is_relative_to(runtime)}


class _Lines:
    """The line table of an ELF file, in order of addresses."""

    def __init__(self, elf: Path) -> None:
        self._rows: list[tuple[int, int, Path, int]] = []
        with elf.open("rb") as stream:
            dwarf = ELFFile(stream).get_dwarf_info()
            for unit in dwarf.iter_CUs():
                program = dwarf.line_program_for_CU(unit)
                if program is not None:
                    self._rows += _rows(program)
        self._rows.sort(key=_END)

    def of(self, block: Block) -> Iterator[tuple[Path, int]]:
        """Files and lines of a block's instructions.

        Where the linker has made `jmp` an `rjmp`, the line behind it begins at the jump in the
        table. A jump belongs to the line before, unless the block is nothing else.
        """
        for first, last, file, line in self._from(block.begin):
            if first >= block.end:
                return
            if first != block.jump or first == block.begin or last == block.end:
                yield file, line

    def at(self, address: int) -> tuple[Path, int] | None:
        """That of one instruction."""
        for first, _, file, line in self._from(address):
            return (file, line) if first <= address else None
        return None

    def _from(self, address: int) -> list[tuple[int, int, Path, int]]:
        """The rows that end behind an address."""
        return self._rows[bisect_right(self._rows, address, key=_END) :]


def _rows(program: LineProgram) -> Iterator[tuple[int, int, Path, int]]:
    """Address, address behind, file and line. Files are compiled by their whole paths."""
    folders = [Path(), *(Path(name.decode()) for name in program["include_directory"])]
    files = [
        (folders[entry.dir_index] / entry.name.decode()).resolve()
        for entry in program["file_entry"]
    ]
    before = None
    for entry in program.get_entries():
        state = entry.state
        if state is None:
            continue
        if before is not None and before.address < state.address and before.line:
            yield before.address, state.address, files[before.file - 1], before.line
        before = None if state.end_sequence else state
