"""Asks all robots how they are, and makes a table of what they say."""

from collections.abc import Iterable
from typing import Any

from kilotwin.files.headers import ALL_ROBOTS, MOST_SLOTS_LOG2, VITALS
from kilotwin.table.links.robot_link import LoaderState, Report, RobotLink

# Slots of the first question; as many as twice the robots that are known, later.
_FIRST_SLOTS_LOG2 = 6
_NONCES = 256
# The converter's reference is 3 V, and the battery comes to it halved (hardware.md 1.3).
_FULL_SCALE_V, _READINGS = 6.0, 1024
_COLOURS = ((682, "green"), (648, "blue"), (614, "yellow"))
"""Above the reading a robot shows this colour after VOLTAGE; else red."""
_LOADER_STATES = {
    LoaderState.NOTHING: "boot loader, no program",
    LoaderState.LOADING: "boot loader, loading",
    LoaderState.COMPLETE: "boot loader, complete",
    LoaderState.WRONG: "boot loader, CRC wrong",
}

WITHOUT_UID = f"robots without a uid answer as {ALL_ROBOTS}, and cannot be told apart"
"""For tables that have such a robot."""


class RollCall:
    """The last answer of each robot on a link whose robots answer."""

    def __init__(self, link: RobotLink) -> None:
        self._link = link
        self._nonce = 0
        self.robots: dict[int, Report] = {}

    def ask(self) -> int:
        """One question to all; how many robots were heard for the first time."""
        before = len(self.robots)
        slots_log2 = max(_FIRST_SLOTS_LOG2, (2 * before).bit_length())
        self._nonce = (self._nonce + 1) % _NONCES
        for report in self._link.ask(VITALS, min(MOST_SLOTS_LOG2, slots_log2), self._nonce):
            self.robots[report.uid] = report
        return len(self.robots) - before

    def ask_until(self, quiet: int, expected: int | None = None) -> None:
        """Asks until `quiet` questions in a row brought no new robot, or all expected are there."""
        left = quiet
        while left > 0 and (expected is None or len(self.robots) < expected):
            left = quiet if self.ask() else left - 1

    def as_list(self) -> list[dict[str, Any]]:
        """The robots by uid, for --json."""
        return [
            {
                "uid": uid,
                "module": list(robot.module) if robot.module else None,
                "cell": robot.cell,
                "reading": robot.voltage,
                "volts": None if robot.voltage is None else round(volts(robot.voltage), 2),
                "state": state_of(robot),
            }
            for uid, robot in sorted(self.robots.items())
        ]

    def text(self) -> str:
        """The same as a table, and a line with the number of robots."""
        rows: list[tuple[str, ...]] = [("uid", "module", "cell", "volts", "reading", "state")]
        rows += [_row(robot) for _, robot in sorted(self.robots.items())]
        lines = [
            *aligned(rows),
            f"{len(self.robots)} robot{'s answer' if len(self.robots) != 1 else ' answers'}",
        ]
        if ALL_ROBOTS in self.robots:
            lines.append(WITHOUT_UID)
        return "\n".join(lines)


def volts(reading: int) -> float:
    """The battery's voltage of a reading of get_voltage()."""
    return reading * _FULL_SCALE_V / _READINGS


def colour_of(reading: int) -> str:
    """The colour that a robot shows after VOLTAGE."""
    return next((colour for above, colour in _COLOURS if reading > above), "red")


def colours() -> str:
    """Meaning of the colours after VOLTAGE, in a line."""
    parts = [f"{colour} above {volts(above):.1f} V" for above, colour in _COLOURS]
    return f"{', '.join(parts)}, red: charge it"


def state_of(robot: Report) -> str:
    """A robot's state, in a word or three."""
    if robot.loader_state is not None:
        return _LOADER_STATES[robot.loader_state]
    if robot.robot_state is not None:
        return robot.robot_state.name.lower()
    return f"unknown state {robot.state}"


def place(module: tuple[int, int] | None, cell: int | None) -> tuple[str, str]:
    """Two columns of a table: the module and the cell that heard a robot; empty for none."""
    return f"{module[0]}-{module[1]}" if module else "", "" if cell is None else str(cell)


def aligned(rows: Iterable[tuple[str, ...]]) -> list[str]:
    """Rows as lines: columns to the right, but the last one."""
    rows = list(rows)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    *narrow, _ = widths
    return [
        "  ".join([*(cell.rjust(width) for cell, width in zip(row, narrow, strict=False)), row[-1]])
        for row in rows
    ]


def _row(robot: Report) -> tuple[str, ...]:
    reading = robot.voltage
    return (
        str(robot.uid),
        *place(robot.module, robot.cell),
        "" if reading is None else f"{volts(reading):.2f}",
        "" if reading is None else str(reading),
        state_of(robot) + ("" if reading is None else f", {colour_of(reading)}"),
    )
