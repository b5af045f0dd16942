"""Where in a program's sources an event came about, and the robot's uid, added to the event.

An event of the engine has addresses of code. In their place it gets `file` (its path), `line` and
`function` ("" if not known), and its text begins with them. What has no debug information, as a
.hex that came built, keeps its text; the chip's address is in it.
"""

import functools
import itertools
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.programs import Program

if TYPE_CHECKING:
    from kilotwin.programs.code_places import CodePlaces, Place

CODE = "code"
FIELDS = ("file", "line", "function")


def uid_of(event: Mapping[str, Any]) -> int:
    """The uid of the robot that an event is about; its index and 1 if the event has none."""
    return int(event.get("uid", event["robot"] + 1))


class EventPlaces:
    """Knows the programs of an experiment."""

    def __init__(self, experiment: Experiment, symbols: Sequence[Path | None]) -> None:
        """`symbols`: a file for each group, then one for modules (Guest.symbols). They are read
        now, before this process is confined, and looked into when something happens."""
        groups = experiment.groups
        self._uid_of = experiment.uid_of
        self._ends = list(itertools.accumulate(group.count for group in groups))
        modules = [experiment.modules] if experiment.modules is not None else []
        self._programs = [
            None if file is None else _program(file, file.stat().st_mtime_ns, group.program)
            for group, file in zip([*groups, *modules], symbols, strict=False)
        ]

    def of_robot(self, event: Mapping[str, Any]) -> dict[str, Any]:
        """An event of a robot's program, with its place, and the uid that the robot began with."""
        robot = event["robot"]
        row = {"uid": self._uid_of(robot), **event}
        return self._placed(row, bisect_right(self._ends, robot))

    def of_module(self, event: Mapping[str, Any]) -> dict[str, Any]:
        """The same of a module's."""
        return self._placed(event, len(self._ends))

    def _placed(self, event: Mapping[str, Any], group: int) -> dict[str, Any]:
        row = dict(event)
        code = row.pop(CODE, None)
        program = self._programs[group] if group < len(self._programs) else None
        place = None if code is None or program is None else program.place(tuple(code))
        if place is None:
            return row
        text = f"at {place.text()}: {row['text']}"
        told = {"file": str(place.file), "line": place.line, "function": place.function}
        return {**row, "text": text, **told}


class _Program:
    """A program, and what is known of its addresses. Most runs never ask."""

    def __init__(self, symbols: bytes, program: Program) -> None:
        self._symbols, self._program = symbols, program
        self._places: CodePlaces | None = None
        self._known: dict[tuple[int, ...], Place | None] = {}

    def place(self, code: tuple[int, ...]) -> "Place | None":
        if self._places is None:
            from kilotwin.programs.code_places import CodePlaces

            self._places = CodePlaces(self._symbols, self._program)
        if code not in self._known:
            self._known[code] = self._places.of(code)
        return self._known[code]


@functools.lru_cache(maxsize=16)
def _program(file: Path, changed_ns: int, program: Program) -> _Program:
    """Kept, since each of many short trials asks for the same."""
    return _Program(file.read_bytes(), program)
