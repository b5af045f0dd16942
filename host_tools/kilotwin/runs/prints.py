"""Prints of robots, in a file each: `prints/robot-7.log` in the run folder, by uid.

Every line begins with the world's time and tick when it began. A robot may print a line in parts.
"""

import re
from collections.abc import Hashable, Iterator, Mapping
from pathlib import Path
from typing import Any

from kilotwin.experiment.schema.record import Record
from kilotwin.units import seconds

LEFT_OUT = "left_out"
_LINES = re.compile(r"[^\n]*\n|[^\n]+")


class PrintLimit:
    """Keeps a program that prints for ever from filling the disk; counts what is left out."""

    def __init__(self, record: Record) -> None:
        """By the keys prints_per_robot and prints of [record]."""
        self._per_robot, self._in_all = record.prints_per_robot, record.prints
        self._kept: dict[Hashable, int] = {}
        self._left_out: dict[Hashable, tuple[Mapping[str, Any], int]] = {}

    def admits(self, event: Mapping[str, Any]) -> bool:
        """Whether this print is kept; it is counted."""
        printer = event.get("robot", event.get("module"))
        kept = self._kept.get(printer, 0)
        if kept < self._per_robot and self._in_all > 0:
            self._kept[printer] = kept + 1
            self._in_all -= 1
            return True
        first, number = self._left_out.get(printer, (event, 0))
        self._left_out[printer] = (first, number + 1)
        return False

    def left_out(self) -> Iterator[dict[str, Any]]:
        """An event for each robot or module that printed more, at the first print left out."""
        for first, number in self._left_out.values():
            text = f"{number} more prints are left out; record.prints_per_robot and record.prints"
            yield {**first, "kind": LEFT_OUT, "text": f"{text} say how many are kept"}


class Prints:
    """Prints of all robots."""

    def __init__(self, folder: Path) -> None:
        """The folder appears with the first print."""
        self._folder = folder
        self._in_line: set[int] = set()  # robots whose last line has no end yet
        self._unwritten: dict[int, list[str]] = {}

    def add(self, robot: int, tick: int, text: str) -> None:
        """Adds what the robot with that uid printed at a tick, to be written soon."""
        stamp = f"[{seconds(tick):10.3f} s, tick {tick:7}] "
        lines = self._unwritten.setdefault(robot, [])
        for number, line in enumerate(_LINES.findall(text)):
            lines.append(line if number == 0 and robot in self._in_line else stamp + line)
        if text.endswith("\n"):
            self._in_line.discard(robot)
        elif text:
            self._in_line.add(robot)

    def write(self) -> None:
        """Appends all that was added, so that it is kept when a run is killed."""
        if self._unwritten:
            self._folder.mkdir(exist_ok=True)
        for robot, lines in self._unwritten.items():
            with (self._folder / f"robot-{robot}.log").open("a", newline="") as file:
                file.write("".join(lines))
        self._unwritten.clear()
