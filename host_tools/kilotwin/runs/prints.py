"""Prints of robots, in a file each: `prints/robot-7.log` in the run folder.

Every line begins with the world's time and tick when it began. A robot may print a line in parts.
"""

import re
from pathlib import Path

from kilotwin.units import seconds


class Prints:
    """Appends at once, so that nothing is lost when a run is killed."""

    def __init__(self, folder: Path) -> None:
        """The folder appears with the first print."""
        self._folder = folder
        self._in_line: set[int] = set()  # robots whose last line has no end yet

    def add(self, robot: int, tick: int, text: str) -> None:
        """Adds what a robot printed at a tick."""
        self._folder.mkdir(exist_ok=True)
        stamp = f"[{seconds(tick):10.3f} s, tick {tick:7}] "
        lines = re.findall(r"[^\n]*\n|[^\n]+", text)
        stamped = [
            line if number == 0 and robot in self._in_line else stamp + line
            for number, line in enumerate(lines)
        ]
        with (self._folder / f"robot-{robot}.log").open("a", newline="") as file:
            file.write("".join(stamped))
        if text.endswith("\n"):
            self._in_line.discard(robot)
        elif text:
            self._in_line.add(robot)
