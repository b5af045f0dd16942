"""From machine code to lines: what has run of a program's sources, by the ELF's line table.

A line has run if an instruction of it has. A branch is one of the machine code: an `if` with `&&`
has several, and a loop that the compiler laid out in two parts has one more.
"""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from elftools.elf.elffile import ELFFile

from kilotwin import _emulator
from kilotwin.experiment.programs import Program
from kilotwin.programs.code_places import own_folders
from kilotwin.programs.coverage.marks import NOT_TAKEN, RAN, TAKEN, Marks
from kilotwin.programs.image.image import Image
from kilotwin.programs.line_table import LineTable
from kilotwin.programs.translate.seam import seam_of
from kilotwin.programs.translate.translator import Block, blocks_of


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
    own = own_folders(program)
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


class _Lines:
    """The line table of an ELF file, as coverage reads it."""

    def __init__(self, elf: Path) -> None:
        with elf.open("rb") as stream:
            self._table = LineTable(ELFFile(stream).get_dwarf_info())

    def of(self, block: Block) -> Iterator[tuple[Path, int]]:
        """Files and lines of a block's instructions.

        Where the linker has made `jmp` an `rjmp`, the line behind it begins at the jump in the
        table. A jump belongs to the line before, unless the block is nothing else.
        """
        for row in self._table.ending_behind(block.begin):
            if row.first >= block.end:
                return
            if row.first != block.jump or row.first == block.begin or row.end == block.end:
                yield row.file, row.line

    def at(self, address: int) -> tuple[Path, int] | None:
        """That of one instruction."""
        row = self._table.at(address)
        return None if row is None else (row.file, row.line)
