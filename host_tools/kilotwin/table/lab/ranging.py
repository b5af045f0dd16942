"""Gain tables of pairs of robots: what each reads of the other at known distances, and its EEPROM.

Robots lie in pairs, at the same distance in each pair, and each pair beyond the reach of the
others. Each question for vitals makes both of a pair send; their answers also say how strongly the
other one came in the last time. Cells pass one answer in four on, so all are asked again until
each has told enough.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from kilotwin.experiment.spec.overhead import WAKEUP, calib_gains
from kilotwin.files.headers import GAIN_DISTANCES_MM, GAIN_ENTRIES, GAINS, VITALS
from kilotwin.table.lab.gain_tables import GainTables, fitted, tables_of
from kilotwin.table.links.robot_link import Gains, Heard, Report, RobotLink

READINGS = 8
"""Readings of each robot at each distance."""
ALL_ENTRIES = range(GAIN_ENTRIES)

# Answers spread over 2 or 4 ticks, in turn: two of a pair seldom meet, and no beat goes on for long
# between the questions and the time at which a cell listens.
_LEAST_SLOTS_LOG2 = 1
_NONCES = 256
# Questions in a row, until robots that do not answer are given up: some are hardly heard for a
# minute, when their ticks go by between the moments at which their cell listens.
_PATIENCE = 200
# Answers in a row that tell of nothing new: the robot is beyond the reach of its partner.
_DEAF = 16
# Cells repeat a message every 0.52 s.
_HOLD_S = 0.8
# Frames of neighbouring cells meet where a robot hears both.
_ATTEMPTS_TO_SAVE = 12

Readings = Mapping[int, Sequence[Gains]]
Progress = Callable[[str, float], None]


class Jig(Protocol):
    """Whatever brings the robots of each pair to a distance: a person, a machine, an emulation."""

    how: str
    """For the lab's file."""

    def place(self, mm: int) -> RobotLink:
        """Returns when they lie there, with the way to them."""


@dataclass
class RangedRobot:
    """A robot under calibration."""

    uid: int
    partner: int
    came_with: GainTables | None = None
    """Contents of its EEPROM; None: erased, or it did not tell."""
    readings: dict[int, list[Gains]] = field(default_factory=dict)
    """By distance in mm, those of the tables."""
    checks: dict[int, list[Gains]] = field(default_factory=dict)
    """The same at other distances, which no table is made of."""
    tables: GainTables | None = None
    """Fitted, once it has told enough at each distance."""
    saved: bool = False
    """Its EEPROM holds them, as it has said."""


@dataclass
class _Told:
    """Readings that a robot told at one distance."""

    gains: list[Gains] = field(default_factory=list)
    last: Heard | None = None
    in_vain: int = 0
    """Answers in a row with nothing new."""

    def take(self, heard: Heard) -> None:
        """The first answer may be of the distance before; one with the same count tells again."""
        before, self.last = self.last, heard
        if before is None or before.count == heard.count:
            self.in_vain += 1
        else:
            self.in_vain = 0
            self.gains.append(heard.gains)


class Ranging:
    """One calibration of some pairs of robots."""

    def __init__(
        self,
        pairs: Iterable[tuple[int, int]],
        jig: Jig,
        progress: Progress = lambda text, share: None,
        readings: int = READINGS,
    ) -> None:
        """`pairs` by uid, each uid once. `readings` of each robot at each distance."""
        self.how = jig.how
        self._jig = jig
        self._progress = progress
        self._wanted = readings
        self._nonce = 0
        self._placed = False
        self.robots: dict[int, RangedRobot] = {}
        for one, other in pairs:
            self.robots[one] = RangedRobot(one, other)
            self.robots[other] = RangedRobot(other, one)

    def run(self, checks_mm: Sequence[int] = ()) -> None:
        """All distances of the tables, then those at which tables are only checked; then saves."""
        for mm in GAIN_DISTANCES_MM:
            link = self.run_at(mm)
        for robot in self.robots.values():
            robot.tables = fitted(robot.readings)
        for mm in checks_mm:
            link = self._jig.place(mm)
            for uid, readings in self._measure(link, f"checking at {mm} mm").items():
                self.robots[uid].checks[mm] = readings
        self._save(link)

    def run_at(self, mm: int) -> RobotLink:
        """One distance of the tables; at the first one those that robots have are read."""
        link = self._jig.place(mm)
        if not self._placed:
            self._read_tables(link)
        self._placed = True
        for uid, readings in self._measure(link, f"reading at {mm} mm").items():
            self.robots[uid].readings[mm] = readings
        return link

    def _ask(self, link: RobotLink, first: int) -> list[Report]:
        self._nonce = (self._nonce + 1) % _NONCES
        slots_log2 = _LEAST_SLOTS_LOG2 + self._nonce % 2
        reports = link.ask(first, slots_log2, self._nonce)
        return [report for report in reports if report.uid in self.robots and not report.in_loader]

    def _measure(self, link: RobotLink, text: str) -> dict[int, list[Gains]]:
        """Readings that each robot told; [] of a robot that told too few."""
        told = {uid: _Told() for uid in self.robots}
        left, quiet = dict(told), 0
        while left and quiet < _PATIENCE:
            done = sum(min(len(one.gains), self._wanted) for one in told.values())
            self._progress(text, done / (self._wanted * len(told)))
            quiet += 1
            for report in self._ask(link, VITALS):
                told[report.uid].take(report.heard)
                quiet = 0 if report.uid in left else quiet
            left = {
                uid: one
                for uid, one in left.items()
                if len(one.gains) < self._wanted and one.in_vain < _DEAF
            }
        return {
            uid: one.gains if 2 * len(one.gains) >= self._wanted else []
            for uid, one in told.items()
        }

    def _read_tables(self, link: RobotLink) -> None:
        told = self._entries(link, dict.fromkeys(self.robots, ALL_ENTRIES), "reading tables")
        for uid, entries in told.items():
            if len(entries) == GAIN_ENTRIES:
                self.robots[uid].came_with = tables_of([entries[i] for i in range(GAIN_ENTRIES)])

    def _entries(
        self, link: RobotLink, wanted: Mapping[int, Collection[int]], text: str
    ) -> dict[int, dict[int, Gains]]:
        """Entries of robots' tables as they tell them; one that stays silent is asked no more."""
        found: dict[int, dict[int, Gains]] = {uid: {} for uid in wanted}
        silent: set[int] = set()
        for entry in range(GAIN_ENTRIES):
            left = {uid for uid, entries in wanted.items() if entry in entries} - silent
            for _ in range(_PATIENCE):
                if not left:
                    break
                self._progress(text, (entry + 1 - len(left) / len(wanted)) / GAIN_ENTRIES)
                for report in self._ask(link, GAINS + entry):
                    if report.uid in left:
                        left.discard(report.uid)
                        found[report.uid][entry] = report.entry
            silent |= left
        return found

    def _save(self, link: RobotLink) -> None:
        """Entries that differ from what a robot says are written, and asked for again."""
        link.repeat(WAKEUP, _HOLD_S)  # a robot whose program runs writes nothing
        left: dict[int, set[int]] = {
            uid: set(ALL_ENTRIES) for uid, robot in self.robots.items() if robot.tables is not None
        }
        for attempt in range(_ATTEMPTS_TO_SAVE + 1):
            told = self._entries(link, left, f"saving, attempt {attempt}: asking what they have")
            for uid, has in told.items():
                left[uid] -= {entry for entry in has if has[entry] == self._entry(uid, entry)}
                self.robots[uid].saved = not left[uid]
            left = {uid: entries for uid, entries in left.items() if entries}
            if not left or attempt == _ATTEMPTS_TO_SAVE:
                return
            for number, (uid, entries) in enumerate(left.items()):
                self._progress(f"saving, attempt {attempt + 1}", number / len(left))
                for entry in sorted(entries & told[uid].keys()):
                    gains = self._entry(uid, entry)
                    link.repeat(calib_gains(uid, entry, gains.low, gains.high), _HOLD_S)

    def _entry(self, uid: int, entry: int) -> Gains:
        """As it was measured."""
        tables = self.robots[uid].tables
        assert tables is not None
        return tables.entry(entry)
