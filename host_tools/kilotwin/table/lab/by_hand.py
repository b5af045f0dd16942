"""Duties of one robot set by hand: keys change them, the robot moves at once.

Pure but for the link: a key in, a line for people out.
"""

from collections.abc import Collection, Mapping, Sequence

from kilotwin.experiment.spec.overhead import DUTIES, WAKEUP, CalibMode, calib
from kilotwin.table.links.robot_link import Report, RobotLink
from kilotwin.table.links.roll_call import RollCall

# Keys of the four duties in the order of CALIB: more above less, as they lie on the keyboard.
_CHANGES: Mapping[str, tuple[int, int]] = {
    **{"q": (0, 1), "a": (0, -1), "w": (1, 1), "s": (1, -1)},
    **{"e": (2, 1), "d": (2, -1), "r": (3, 1), "f": (3, -1)},
}
_TRIALS: Mapping[str, CalibMode] = {"1": "turn_left", "2": "turn_right", "3": "straight"}
_OF_DUTY: tuple[CalibMode, ...] = ("turn_left", "turn_right", "straight", "straight")
_STOP, _SAVE, _QUIT = " ", "S", "x"
# Long enough for a grid's cells, which repeat a message every 0.52 s.
_HOLD_S = 0.6
# A cell misses every second answer and more.
_QUESTIONS = 12

HELP = (
    "1 turn left, 2 turn right, 3 straight on, space stop\n"
    "q/a turn left more/less, w/s turn right, e/d straight left, r/f straight right\n"
    "S save, x leave; what was not saved is lost"
)
"""The keys, for people."""


class ByHand:
    """One robot under calibration. It is told alone, unless its runtime is an original one."""

    def __init__(self, link: RobotLink, uid: int, duties: tuple[int, int, int, int]) -> None:
        """`duties` as CALIB has them."""
        self._link = link
        self._uid = uid
        self._duties = list(duties)
        self.saved = False
        """The present duties are in the robot's EEPROM, as far as can be told."""
        self.over = False

    @property
    def duties(self) -> dict[str, int]:
        """By the names of their keys."""
        return dict(zip(DUTIES, self._duties, strict=True))

    def line(self) -> str:
        """The present duties, for people."""
        values = "  ".join(f"{key.replace('_', ' ')} {duty}" for key, duty in self.duties.items())
        return f"robot {self._uid}: {values}  {'saved' if self.saved else 'not saved'}"

    def press(self, key: str) -> bool:
        """Acts on a key; False if it has no meaning."""
        if key in _CHANGES:
            index, step = _CHANGES[key]
            self._duties[index] = min(max(self._duties[index] + step, 0), 255)
            self.saved = False
            self._try(_OF_DUTY[index])
        elif key in _TRIALS:
            self._try(_TRIALS[key])
        elif key == _STOP:
            self._try("uid")
        elif key == _SAVE:
            save(self._link, self._uid, self._duties)
            self.saved = True
        elif key == _QUIT:
            self._try("uid")
            self.over = True
        else:
            return False
        return True

    def _try(self, mode: CalibMode) -> None:
        self._link.repeat(calib(mode, self._uid, self._duties, only=True), _HOLD_S)


def save(
    link: RobotLink,
    uid: int,
    duties: Sequence[int],
    new_uid: int | None = None,
    hold_s: float = _HOLD_S,
) -> None:
    """Has a robot write the duties, and a new uid if there is one, into its EEPROM.

    Robots save after a trial only. A new uid goes to all that are in a trial: first all stop, then
    this one alone begins one.
    """
    if new_uid is not None:
        link.repeat(WAKEUP, hold_s)
    link.repeat(calib("uid", uid, duties, only=True), hold_s)
    if new_uid is None:
        link.repeat(calib("save", uid, duties, only=True), hold_s)
    else:
        link.repeat(calib("save", new_uid, duties), hold_s)


def heard(link: RobotLink, uids: Collection[int]) -> dict[int, Report]:
    """The newest answers of robots, as soon as these have answered; of those that do."""
    roll = RollCall(link)
    for _ in range(_QUESTIONS):
        if all(uid in roll.robots for uid in uids):
            break
        roll.ask()
    return roll.robots
