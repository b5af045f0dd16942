"""The overhead controller's messages: what each is on the wire, and which keys go with it."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Literal, get_args

from kilotwin.experiment.schema.experiment import Command, Sent
from kilotwin.experiment.schema.profile_defaults import Profile
from kilotwin.files.headers import GAINS
from kilotwin.units import ticks

ALL_ROBOTS = (0, 0xFFFF)
DATA_BYTES = 9

# hardware.md 1.4
_TYPES: Mapping[str, int] = {
    "reset": 0x83,
    "sleep": 0x84,
    "pause": 0x85,
    "wakeup": 0x85,
    "charge": 0x86,
    "voltage": 0x87,
    "run": 0x88,
    "readuid": 0x89,
    "calib": 0x8A,
}
CalibMode = Literal["save", "uid", "turn_left", "turn_right", "straight"]
"""In the order of their numbers."""
DUTIES = ("turn_left", "turn_right", "straight_left", "straight_right")
"""The duties of CALIB, in its order."""
CALIB_MARK = b"KT"
"""The last bytes of a CALIB that is for one robot alone (kilolib/core/calibration.h)."""

# A message's own keys: those it cannot do without, and those it may have.
KEYS: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    **dict.fromkeys(get_args(Sent), ((), ())),
    "readuid": (("bit",), ()),
    "calib": (("mode",), ("uid", *DUTIES)),
    "user": (("type",), ("data",)),
}

Region = tuple[float, float, float]
# Tick, first uid, last uid, nine bytes and the type, and where (None: everywhere).
TimedMessage = tuple[int, int, int, bytes, Region | None]


def message(data: Sequence[int], message_type: int) -> bytes:
    """Data, filled up with zeros, and the type. The CRC is not part of it."""
    return bytes(data).ljust(DATA_BYTES, b"\0") + bytes([message_type])


COMMANDS: Mapping[str, int] = {
    name: number for name, number in _TYPES.items() if name not in ("readuid", "calib")
}
"""Messages that are nothing but their type."""

RUN = message((), _TYPES["run"])
RESET = message((), _TYPES["reset"])
WAKEUP = message((), _TYPES["wakeup"])


def readuid(bit: int) -> bytes:
    """Has those robots turn left whose uid has this bit, 0 to 15; the others stop."""
    return message([bit], _TYPES["readuid"])


def message_of(command: Command, profile: Profile) -> bytes:
    """The message that goes on air."""
    if command.send == "user":
        assert command.type is not None
        return message(command.data or (), command.type)
    if command.send == "readuid":
        assert command.bit is not None
        return readuid(command.bit)
    data: list[int] = []
    if command.send == "calib":
        assert command.mode is not None
        given = [getattr(command, name) for name in DUTIES]
        duties = [
            getattr(profile, name) if duty is None else duty
            for name, duty in zip(DUTIES, given, strict=True)
        ]
        return calib(command.mode, command.uid or 0, duties)
    return message(data, _TYPES[command.send])


def calib(mode: CalibMode, uid: int, duties: Sequence[int], *, only: bool = False) -> bytes:
    """CALIB with the four duties of DUTIES. `only`: for the robot with this uid alone, if its
    runtime is ours (kilolib/core/calibration.h); else for all, and `uid` is what SAVE writes."""
    mark = CALIB_MARK if only else b""
    data = [get_args(CalibMode).index(mode), *uid.to_bytes(2, "little"), *duties, *mark]
    return message(data, _TYPES["calib"])


def calib_gains(uid: int, entry: int, low_gain: int, high_gain: int) -> bytes:
    """CALIB that has the robot with this uid write one entry of its gain tables, 0 to 13.

    Its runtime has to be ours (kilolib/core/calibration.h).
    """
    words = low_gain.to_bytes(2, "big") + high_gain.to_bytes(2, "big")
    data = [GAINS + entry, *uid.to_bytes(2, "little"), *words, *CALIB_MARK]
    return message(data, _TYPES["calib"])


def uids(command: Command) -> tuple[int, int]:
    """The first and the last uid that a command is for."""
    if command.robot is not None:
        return command.robot, command.robot
    first, last = ALL_ROBOTS
    return (
        first if command.uid_first is None else command.uid_first,
        last if command.uid_last is None else command.uid_last,
    )


def region(command: Command) -> Region | None:
    """The region whose robots a command is for; None for all."""
    if command.centre_m is None or command.within_m is None:
        return None
    x, y = command.centre_m
    return float(x), float(y), float(command.within_m)


def timed(command: Command, profile: Profile) -> Iterator[TimedMessage]:
    """The message as often as it is sent: one a tick for as long as it is repeated."""
    begin = ticks(command.at_s)
    bytes_, where = message_of(command, profile), region(command)
    for tick in range(begin, begin + max(1, ticks(command.repeat_s))):
        yield (tick, *uids(command), bytes_, where)
