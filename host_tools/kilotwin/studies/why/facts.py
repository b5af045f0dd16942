"""Facts of a run that was repeated with a trail: messages that were received, changes that robots'
code made, and what it sent. Times are seconds since the run began; robots go by their index."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np

from kilotwin.runs.columns import StationKind
from kilotwin.runs.trail import Recorded

NEVER_S = -math.inf
"""The time of what has not been."""

Path = tuple[int, ...]
"""Where code was: addresses, the innermost first."""


class What(IntEnum):
    """Kinds of changes, as Trail::What of the engine."""

    LED = 0
    MOTORS = 1
    CALLBACK = 2
    MESSAGE = 3
    ASKED = 4


class During(IntEnum):
    """Where code ran: in the main loop, the timer's interrupt, or with a message."""

    LOOP = 0
    TICK = 1
    MESSAGE = 2


@dataclass(frozen=True, order=True)
class Station:
    """A sender or receiver, with its number among those of its kind."""

    kind: StationKind
    number: int


@dataclass(frozen=True)
class Message:
    """A frame that was received; `data` has nine bytes and the type."""

    begin_s: float
    at_s: float
    sender: Station
    receiver: Station
    data: bytes


@dataclass(frozen=True)
class Input:
    """A number that was drawn, or a reading that was taken."""

    at_s: float
    path: Path
    value: int


@dataclass(frozen=True)
class Change:
    """A change of what a robot shows, how it drives, or of a byte in its memory.

    `before_s`: when the same was last changed. `heard_s`, `heard_nth`: the message that the
    callback got, During.MESSAGE: its end, and its number among those that ended then. `drawn`,
    `sensed`: the robot's last ones before. `sent`: of What.MESSAGE, the Sending's number.
    """

    what: What
    robot: int
    at_s: float
    before_s: float
    heard_s: float
    heard_nth: int
    tick: int
    during: During
    path: Path
    address: int
    was: int
    now: int
    drawn: Input
    sensed: Input
    sent: int


@dataclass(frozen=True)
class Sending:
    """A robot sends what it has not sent the last time, from `address` in its memory."""

    at_s: float
    robot: int
    number: int
    address: int
    data: bytes


class Facts:
    """All of a run, found by who and when."""

    def __init__(self, recorded: Recorded) -> None:
        """Rows as the engine gives them, in any order."""
        self._arrivals = np.sort(recorded.arrivals, order=["at_s"], kind="stable")
        self._writes = np.sort(recorded.writes, order=["at_s"], kind="stable")
        self._sendings = recorded.sendings
        self._paths = recorded.paths
        self.is_whole = recorded.forgotten == 0
        """Whether all facts of the run are there."""

    def changes(self, robot: int, what: What, until_s: float) -> list[Change]:
        """Those of a robot up to a moment, in order of time."""
        rows = self._writes
        wanted = (rows["robot"] == robot) & (rows["what"] == what) & (rows["at_s"] <= until_s)
        return [self._change(row) for row in rows[wanted]]

    def of_sending(self, number: int) -> list[Change]:
        """The last changes of the bytes of a message that was sent, in order of time."""
        rows = self._writes
        return [
            self._change(row)
            for row in rows[(rows["what"] == What.MESSAGE) & (rows["sent"] == number)]
        ]

    def messages_to(
        self, receiver: Station, since_s: float, until_s: float, span: int = 1
    ) -> list[Message]:
        """Those whose frames ended behind `since_s` and up to `until_s`, in order of time; of
        `span` receivers from that one on."""
        rows = self._arrivals
        wanted = (
            (rows["to_kind"] == receiver.kind)
            & (rows["to"] >= receiver.number)
            & (rows["to"] < receiver.number + span)
            & (rows["at_s"] > since_s)
            & (rows["at_s"] <= until_s)
        )
        return [_message(row) for row in rows[wanted]]

    def messages_of(self, sender: Station, until_s: float) -> list[Message]:
        """Those of one sender that began up to a moment, received by any station, in order of
        time."""
        rows = self._arrivals
        wanted = (
            (rows["from_kind"] == sender.kind)
            & (rows["from"] == sender.number)
            & (rows["begin_s"] <= until_s)
        )
        return [_message(row) for row in rows[wanted]]

    def heard(self, change: Change) -> Message | None:
        """The message that the callback got which made the change."""
        rows = self._arrivals
        here = (rows["to_kind"] == StationKind.ROBOT) & (rows["to"] == change.robot)
        found = rows[here & (rows["at_s"] == change.heard_s)]
        return _message(found[min(change.heard_nth, len(found) - 1)]) if len(found) else None

    def sending(self, robot: int, until_s: float) -> Sending | None:
        """The last one of a robot up to a moment; None if it is not known."""
        rows = self._sendings
        found = rows[(rows["robot"] == robot) & (rows["at_s"] <= until_s)]
        if not len(found):
            return None
        row = found[np.argmax(found["number"])]
        return Sending(
            float(row["at_s"]),
            robot,
            int(row["number"]),
            int(row["address"]),
            bytes(row["bytes"].tobytes()),
        )

    def _path(self, number: int) -> Path:
        return tuple(self._paths[number]) if number < len(self._paths) else ()

    def _change(self, row: Any) -> Change:
        return Change(
            What(int(row["what"])),
            int(row["robot"]),
            float(row["at_s"]),
            _seconds(row["before_s"]),
            _seconds(row["heard_s"]),
            int(row["heard_nth"]),
            int(row["tick"]),
            During(int(row["during"])),
            self._path(int(row["path"])),
            int(row["address"]),
            int(row["was"]),
            int(row["now"]),
            self._input(row, "drawn"),
            self._input(row, "sensed"),
            int(row["sent"]),
        )

    def _input(self, row: Any, name: str) -> Input:
        path = self._path(int(row[f"{name}_path"]))
        return Input(_seconds(row[f"{name}_s"]), path, int(row[name]))


def joined(changes: Sequence[Change], gap_s: float) -> list[list[Change]]:
    """Changes in order of time, those together that follow one another within `gap_s`; a group
    that ends as it began is none."""
    groups: list[list[Change]] = []
    for change in changes:
        if groups and change.at_s - groups[-1][-1].at_s < gap_s:
            groups[-1].append(change)
        else:
            groups.append([change])
    return [group for group in groups if group[0].was != group[-1].now]


def _message(row: Any) -> Message:
    return Message(
        float(row["begin_s"]),
        float(row["at_s"]),
        Station(StationKind(int(row["from_kind"])), int(row["from"])),
        Station(StationKind(int(row["to_kind"])), int(row["to"])),
        bytes(row["bytes"].tobytes()),
    )


def _seconds(value: Any) -> float:
    seconds = float(value)
    return NEVER_S if math.isnan(seconds) else seconds
