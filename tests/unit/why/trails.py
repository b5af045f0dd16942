"""Trails of runs that were never run: facts, a few at a time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from kilotwin.runs.columns import StationKind
from kilotwin.runs.trail import Recorded
from kilotwin.studies.why.facts import During, Facts, Path, Station, What

ARRIVAL = [
    ("begin_s", "<f8"),
    ("at_s", "<f8"),
    ("from_kind", "u1"),
    ("from", "<u4"),
    ("to_kind", "u1"),
    ("to", "<u4"),
    ("bytes", "V10"),
]
INPUTS = [
    (f"{name}{part}", kind)
    for name in ("drawn", "sensed")
    for part, kind in (("_s", "<f8"), ("_path", "<u4"), ("", "<i4"))
]
WRITE = [
    ("at_s", "<f8"),
    ("before_s", "<f8"),
    ("heard_s", "<f8"),
    ("heard_nth", "<u4"),
    *INPUTS,
    ("robot", "<u4"),
    ("tick", "<u4"),
    ("path", "<u4"),
    ("sent", "<u4"),
    ("address", "<u2"),
    ("was", "<u2"),
    ("now", "<u2"),
    ("what", "u1"),
    ("during", "u1"),
]
SENDING = [
    ("at_s", "<f8"),
    ("robot", "<u4"),
    ("number", "<u4"),
    ("address", "<u2"),
    ("bytes", "V10"),
]
FRAME_S = 0.004
BUFFER = 0x200  # where all robots have their message
ROBOT = StationKind.ROBOT


def message(*data: int) -> bytes:
    return bytes(data).ljust(10, b"\0")


@dataclass
class TrailMaker:
    """Adds facts; a path is one address, which stands for its number too."""

    forgotten: int = 0
    arrivals: list[tuple[object, ...]] = field(default_factory=list)
    writes: list[tuple[object, ...]] = field(default_factory=list)
    sendings: list[tuple[object, ...]] = field(default_factory=list)

    def frame(
        self, sender: int, receiver: int, begin_s: float, data: bytes, kind: StationKind = ROBOT
    ) -> float:
        """One that is received by a robot; returns when."""
        return self.between(Station(kind, sender), Station(ROBOT, receiver), begin_s, data)

    def between(self, sender: Station, to: Station, begin_s: float, data: bytes) -> float:
        at_s = begin_s + FRAME_S
        self.arrivals.append((begin_s, at_s, sender.kind, sender.number, to.kind, to.number, data))
        return at_s

    def change(
        self,
        what: What,
        robot: int,
        at_s: float,
        was: int,
        now: int,
        *,
        place: int = 0,
        address: int = 0,
        before_s: float = math.nan,
        during: During = During.LOOP,
        heard_s: float = math.nan,
        nth: int = 0,
        drawn_s: float = math.nan,
        sensed: tuple[float, int, int] = (math.nan, 0, 0),
        sent: int = 0,
        tick: int = 100,
    ) -> None:
        row = (at_s, before_s, heard_s, nth, drawn_s, 7, 42, *sensed, robot, tick, place, sent)
        self.writes.append((*row, address, was, now, what, during))

    def callback(self, robot: int, at_s: float, heard_s: float, address: int, place: int) -> None:
        """A variable becomes 1 by a message."""
        self.change(
            What.CALLBACK,
            robot,
            at_s,
            0,
            1,
            place=place,
            address=address,
            during=During.MESSAGE,
            heard_s=heard_s,
        )

    def sending(self, robot: int, number: int, at_s: float, data: bytes) -> None:
        self.sendings.append((at_s, robot, number, BUFFER, data))

    def byte(  # noqa: PLR0917 (in the order of the words)
        self, robot: int, number: int, at_s: float, byte: int, was: int, now: int
    ) -> None:
        """The last change of a byte of a message."""
        self.change(
            What.MESSAGE,
            robot,
            at_s,
            was,
            now,
            place=3,
            address=BUFFER + byte,
            sent=number,
        )

    def facts(self) -> Facts:
        def rows(some: Sequence[tuple[object, ...]], kind: list[tuple[str, str]]) -> np.ndarray:
            return np.array(some, np.dtype(kind))

        return Facts(
            Recorded(
                rows(self.arrivals, ARRIVAL),
                rows(self.writes, WRITE),
                rows(self.sendings, SENDING),
                [[number] for number in range(10)],
                self.forgotten,
            )
        )


VARIABLES = {1: "heard", 2: "table"}


class KnownCode:
    """Programs in which the place of code is its address, and variables go by names."""

    HARD, NAMES_HEARD = 9, 1

    def __init__(self, native: int = -1) -> None:
        self._native = native

    def is_watched(self, robot: int) -> bool:
        return robot != self._native

    def place(self, _: int, path: Path) -> str:
        return f"line {path[0]}"

    def variable(self, _: int, address: int) -> str:
        return VARIABLES.get(address, "")

    def reads(self, _: int, path: Path) -> frozenset[str]:
        return frozenset(["heard"] if path[0] == self.NAMES_HEARD else [])

    def draws_at(self, _: int, path: Path) -> bool:
        return self.HARD in path
