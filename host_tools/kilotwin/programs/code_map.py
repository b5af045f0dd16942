"""Functions and variables of a program that runs by its machine code, by their addresses: which
variable a byte is of, which variables a function reads, and which code draws random numbers."""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from pathlib import Path

from elftools.elf.elffile import ELFFile

from kilotwin.programs.translate.instructions import Instruction, decode
from kilotwin.programs.translate.seam import Named, functions_and_variables

HARD = "rand_hard"
"""The function that draws a number by readings of the converter."""
_SOFT = {"rand_soft", "rand", "rand_r", "random", "random_r", "do_random"}


class CodeMap:
    """Those of one linked image."""

    def __init__(self, elf: Path, objects: Sequence[Path]) -> None:
        """`objects`: the program's own (Image.objects)."""
        self.functions, self.variables = functions_and_variables(elf, objects)
        with elf.open("rb") as file:
            code = ELFFile(file).get_section_by_name(".text")
            self._code = b"" if code is None else bytes(int(code["sh_addr"])) + code.data()

    @property
    def draws(self) -> tuple[tuple[int, int], ...]:
        """Extents of functions that draw a random number and keep what the next one follows from;
        each that a program calls so."""
        return tuple((one.begin, one.end) for one in self.functions if one.name in _SOFT)

    def function(self, address: int) -> Named | None:
        """That of an instruction."""
        return _at(self.functions, address)

    def variable(self, address: int) -> Named | None:
        """That of a byte in data space."""
        return _at(self.variables, address)

    def reads(self, path: Sequence[int]) -> frozenset[str]:
        """Names of the program's own variables that its functions on a path of calls name in their
        code."""
        functions = {one for one in map(self.function, path) if one is not None and one.own}
        named = {self.variable(address) for one in functions for address in self._addresses(one)}
        return frozenset(one.name for one in named if one is not None and one.own)

    def _addresses(self, function: Named) -> Iterator[int]:
        """Addresses of data that its instructions name: read directly, or with a pointer made of
        two bytes, also by subtraction, as of an array with an index."""
        before: Instruction | None = None
        at = function.begin
        while at < min(function.end, len(self._code) - 1):
            one = decode(self._code, at)
            if one.name == "lds":
                yield one.k
            elif before is not None and one.d == before.d + 1:
                if before.name == one.name == "ldi":
                    yield before.k | one.k << 8
                elif (before.name, one.name) == ("subi", "sbci"):
                    yield -(before.k | one.k << 8) & 0xFFFF
            before, at = one, one.end


def _at(places: Sequence[Named], address: int) -> Named | None:
    index = bisect_right(places, address, key=lambda one: one.begin) - 1
    return places[index] if index >= 0 and address < places[index].end else None
