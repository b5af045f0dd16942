"""Arrays that a program indexes beyond their bounds while it runs here.

The compiler checks each index and calls a handler of ours, bounds.c, which prints where it was.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from kilotwin.experiment.programs import Program
from kilotwin.programs.port.disassembly import Place
from kilotwin.programs.port.findings import Finding, Weight, listed

FLAGS = ("-fsanitize=bounds",)
"""For the program's own sources."""

_HANDLER = Path(__file__).with_name("bounds.c")
_MARK = "\1"  # how what the handler prints begins


def watched(program: Program) -> Program:
    """The program with the handler; to be built with FLAGS."""
    return replace(program, sources=(*program.sources, _HANDLER))


def findings(prints: Sequence[tuple[int, str]]) -> Iterator[Finding]:
    """Lines of the handler, among all that the program printed: tick and text. One finding for
    each line of the program and array."""
    first: dict[tuple[str, str, str], int] = {}
    indices: dict[tuple[str, str, str], dict[str, None]] = {}
    for tick, text in prints:
        if not text.startswith(_MARK):
            continue
        file, line, index, array = text[len(_MARK) :].rstrip("\n").split("\t")
        first.setdefault((file, line, array), tick)
        indices.setdefault((file, line, array), {})[index] = None
    for (file, line, array), tick in first.items():
        index, *more = indices[file, line, array]
        others = f", then of {listed(more)}" if more else ""
        yield Finding(
            "array-bounds",
            Weight.WARNS,
            f"an index of {index} into {array}, at tick {tick:,}{others}: on the robot that is "
            "another variable, or the stack",
            "make the array larger, or test the index before it is used",
            Place(str(Path(file).resolve()), int(line)),
        )
