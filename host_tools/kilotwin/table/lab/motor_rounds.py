"""Duties of all robots on a Kilogrid at once: they drive, cells see where, duties are bettered.

A round: each robot is told by CALIB, for it alone, to drive in a wide bend, so that most stay on
the table; to the left in one round, to the right in the next, so that what is not proportional in
its motors cancels. While all drive, the modules ask again and again, and forward which
cell heard which robot. One that comes to the table's rim is turned back. Then all stand still, the
tracks say how fast each turned (arcs.py), and that which duties would have led straight
(wheels.py). How fast it drove on its way besides says how strong each of its motors is, and so how
fast it turns on the spot by one of them, which cells cannot see: its middle moves by less than one.

Times are those of the link's clock.
"""

import heapq
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from kilotwin.experiment.spec.overhead import CalibMode, calib
from kilotwin.files.headers import VITALS
from kilotwin.table.grid.clock import Clock
from kilotwin.table.lab.arcs import Point, drift_of
from kilotwin.table.lab.wheels import USUAL_STRENGTH, Duties, Wheels
from kilotwin.table.links.robot_link import RobotLink, RobotState, slot_of
from kilotwin.units import TICK_S

CELL_M = 0.05
ROUNDS = 6
"""At most: a robot that is known well enough stands still in those that follow."""
DRIVE_S = 150.0
"""How long all drive in a round, once the last has begun."""

# Cells repeat a message every 0.52 s, so that one lost frame does no harm.
_HOLD_S = 0.8
# Answers spread over 2^3 ticks, 0.26 s: a cell hears hardly two robots.
_SLOTS_LOG2 = 3
_ORDERS_BETWEEN_LOOKS = 2
# Half a turn at 45 degrees a second.
_TURN_S = 4.0
# A bend of a radius of some 13 cm.
_BEND_RAD_S = 0.1
# So that nearly all have been heard.
_LOOKS_AFTER_SAVING = 12
# For a robot that does not say that it saved: some are hardly heard for two minutes.
_ATTEMPTS_TO_SAVE = 20
# A bend is known well enough: motor noise alone turns a robot by 60 degrees in a metre.
_KNOWN_RAD_M = math.radians(60)
# After which a robot that was turned back has left the rim.
_LEAVES_S = 12.0
# An order is repeated to a robot that stays in one cell for so long: it may have missed it.
_REFRESH_S = 20.0
# Robots whose middle one stands for a usual one.
_MANY = 8
# A robot that is seen less often is not measured.
_SPEED_SD_M_S = 0.002


@dataclass(frozen=True)
class Table:
    """A grid of modules; its corner is (0, 0)."""

    columns: int
    rows: int

    def middle(self, module: tuple[int, int], cell: int) -> tuple[float, float]:
        """A cell's middle, in m: 0 is top left, 3 bottom right, y goes up (hardware.md 3.1)."""
        column, row = 2 * module[0] + cell % 2, 2 * module[1] + (cell < 2)
        return (column + 0.5) * CELL_M, (row + 0.5) * CELL_M

    def is_rim(self, x_m: float, y_m: float) -> bool:
        """Whether it is in the outermost row of cells, where a wall may lead a robot."""
        width, height = 2 * self.columns * CELL_M, 2 * self.rows * CELL_M
        return min(x_m, y_m, width - x_m, height - y_m) < CELL_M


@dataclass
class Robot:
    """A robot that is calibrated, and all that is known of it."""

    uid: int
    turns: Duties
    """The best known duties of its turns, left and right; those that it came with, if they stay."""
    straight: Duties
    """The best known; at first those that it came with."""
    trial: Duties = (0, 0)
    """Duties of the round that goes on."""
    wheels: Wheels = field(default_factory=Wheels.unknown)
    measured: int = 0
    """Rounds in which it was seen well enough."""
    saved: bool = False
    before: Duties = (0, 0)
    """Those that it came with."""
    turns_before: Duties = (0, 0)
    """The same of its turns."""
    legs: list[list[Point]] = field(default_factory=list)
    drives: bool = False
    rim_seen: int = 0
    turned_at_s: float = float("-inf")
    told_at_s: float = float("-inf")

    def bend_sd(self) -> float:
        """How well is known how far it turns in a metre with its best duties: rad/m."""
        return self.wheels.turn_sd(self.straight) / self.wheels.speed_m_s(self.straight)


@dataclass(frozen=True)
class Seen:
    """A robot answered: where, when, and what it does."""

    uid: int
    point: Point
    state: RobotState | None


class MotorRounds:
    """One calibration of the robots on one table."""

    def __init__(
        self,
        link: RobotLink,
        clock: Clock,
        table: Table,
        duties: Mapping[int, Sequence[int]],
        progress: Callable[[str, float], None] = lambda text, share: None,
    ) -> None:
        """`duties` by uid, the four of CALIB. `progress` gets a step and how much of it is done."""
        self._link = link
        self._clock = clock
        self._table = table
        self._progress = progress
        self._nonce = 0
        self._driving: dict[int, Robot] = {}
        self._starts: list[int] = []
        self._orders: list[tuple[float, int, CalibMode]] = []
        self.robots = {
            uid: Robot(
                uid,
                turns=(four[0], four[1]),
                straight=(four[2], four[3]),
                before=(four[2], four[3]),
                turns_before=(four[0], four[1]),
            )
            for uid, four in duties.items()
        }

    def run(self, rounds: int = ROUNDS, drive_s: float = DRIVE_S, *, turns: bool = True) -> None:
        """All rounds; then every robot that was measured has its new duties in its EEPROM.

        Without `turns` those keep their duties.
        """
        for number in range(1, rounds + 1):
            self._driving = {
                uid: robot for uid, robot in self.robots.items() if robot.bend_sd() > _KNOWN_RAD_M
            }
            if not self._driving:
                break
            for robot in self._driving.values():
                # Half of them the other way, so that they spread over the table.
                bend_rad_s = _BEND_RAD_S * (-1) ** (number + robot.uid)
                speed_m_s = robot.wheels.speed_m_s(robot.straight)
                robot.trial = robot.wheels.duties(speed_m_s, bend_rad_s)
            self._drive(f"round {number} of {rounds}", drive_s)
            self._stop()
            for robot in self._driving.values():
                judge(robot)
        if turns:
            choose_turns([robot for robot in self.robots.values() if robot.measured])
        self._save()

    def _drive(self, text: str, drive_s: float) -> None:
        self._starts, self._orders = list(self._driving), []
        for robot in self._driving.values():
            robot.legs, robot.drives = [], False
        while self._starts:
            for uid in self._starts[:_ORDERS_BETWEEN_LOOKS]:
                self._order(uid, "turn_left" if self.robots[uid].rim_seen else "straight")
            del self._starts[:_ORDERS_BETWEEN_LOOKS]
            self._next_order()
            self._look()
            self._progress(f"{text}: they start", 1 - len(self._starts) / len(self._driving))
        begun_s = self._clock.now_s()
        while (passed := self._clock.now_s() - begun_s) < drive_s:
            self._progress(f"{text}: they drive", passed / drive_s)
            self._refresh()
            for _ in range(_ORDERS_BETWEEN_LOOKS):
                self._next_order()
            self._look()

    def _next_order(self) -> None:
        """Sends the order that is due first, if one is."""
        if self._orders and self._orders[0][0] <= self._clock.now_s():
            _, uid, mode = heapq.heappop(self._orders)
            self._order(uid, mode)

    def _order(self, uid: int, mode: CalibMode) -> None:
        robot = self.robots[uid]
        if mode == "turn_left":
            robot.drives = False
            robot.turned_at_s = self._clock.now_s()
            heapq.heappush(self._orders, (robot.turned_at_s + _TURN_S, uid, "straight"))
        self._link.repeat(calib(mode, uid, (*robot.turns, *robot.trial), only=True), _HOLD_S)
        robot.told_at_s = self._clock.now_s()
        if mode == "straight" and not robot.drives:
            robot.drives = True
            robot.legs.append([])

    def _refresh(self) -> None:
        """A robot that stays in one cell may have missed its order; the same again does no harm."""
        for robot in self._driving.values():
            quiet_s = self._clock.now_s() - robot.told_at_s
            if robot.drives and quiet_s > _REFRESH_S and _stays(robot.legs[-1], _REFRESH_S):
                robot.told_at_s = self._clock.now_s()
                heapq.heappush(self._orders, (robot.told_at_s, robot.uid, "straight"))

    def _look(self) -> None:
        for seen in self._ask():
            robot = self._driving.get(seen.uid)
            if robot is None:
                continue
            if not self._table.is_rim(seen.point.x_m, seen.point.y_m):
                robot.rim_seen = 0
                if robot.drives:
                    robot.legs[-1].append(seen.point)
                continue
            robot.rim_seen += 1
            leaves = seen.point.at_s - robot.turned_at_s < _LEAVES_S
            if robot.drives and not leaves:
                robot.turned_at_s = seen.point.at_s
                heapq.heappush(self._orders, (seen.point.at_s, seen.uid, "turn_left"))

    def _ask(self) -> list[Seen]:
        self._nonce = (self._nonce + 1) % 256
        asked_s = self._clock.now_s()
        found: dict[tuple[int, float, float], Seen] = {}
        for report in self._link.ask(VITALS, _SLOTS_LOG2, self._nonce):
            if report.module is None or report.cell is None:
                continue
            x_m, y_m = self._table.middle(report.module, report.cell)
            at_s = asked_s + slot_of(report.uid, self._nonce, _SLOTS_LOG2) * TICK_S
            found[report.uid, x_m, y_m] = Seen(
                report.uid, Point(at_s, x_m, y_m), report.robot_state
            )
        return sorted(found.values(), key=lambda seen: seen.point.at_s)

    def _stop(self) -> None:
        """All stand still, ready to save."""
        self._link.repeat(calib("uid", 0, (0, 0, 0, 0)), 2 * _HOLD_S)

    def _save(self) -> None:
        """A robot that has saved is idle, which it says."""
        measured = [robot for robot in self.robots.values() if robot.measured]
        for attempt in range(1, _ATTEMPTS_TO_SAVE + 1):
            left = [robot for robot in measured if not robot.saved]
            for number, robot in enumerate(left):
                self._progress(f"saving, attempt {attempt}", number / len(left))
                duties = (*robot.turns, *robot.straight)
                if attempt > 1:  # it saves after a trial only
                    self._link.repeat(calib("uid", robot.uid, duties, only=True), _HOLD_S)
                self._link.repeat(calib("save", robot.uid, duties, only=True), _HOLD_S)
            for _ in range(_LOOKS_AFTER_SAVING):
                if all(robot.saved for robot in measured):
                    return
                for seen in self._ask():
                    if seen.uid in self.robots and seen.state == RobotState.IDLE:
                        self.robots[seen.uid].saved = True


def _stays(leg: Sequence[Point], for_s: float) -> bool:
    """Whether its last points are all of one cell, for so long and without any other."""
    if not leg:
        return True
    same = [point for point in leg if point.at_s >= leg[-1].at_s - for_s]
    cells = {(point.x_m, point.y_m) for point in same}
    return len(cells) == 1 and len(same) > 1 and leg[-1].at_s - same[0].at_s > for_s / 2


def choose_turns(robots: Sequence[Robot]) -> None:
    """Duties by which robots that were measured turn alike: as the middle one of many does.

    Speeds of all come out somewhat low where robots stray from their arcs, and that cancels. With
    few it is a usual robot.
    """
    many = len(robots) >= _MANY
    strengths = [robot.wheels.strength for robot in robots] if many else [USUAL_STRENGTH]
    middle = float(np.median(strengths))
    for robot in robots:
        robot.turns = robot.wheels.turn_duties(middle)


def judge(robot: Robot) -> None:
    """Judges its motors by its track, and chooses the next duties."""
    sd = max(robot.wheels.speed_sd(robot.trial), _SPEED_SD_M_S)
    drift = drift_of(robot.legs, robot.wheels.speed_m_s(robot.trial), sd)
    if drift is None:
        return
    robot.measured += 1
    robot.wheels = robot.wheels.after(robot.trial, drift)
    robot.straight = robot.wheels.duties(robot.wheels.speed_m_s(robot.before))
