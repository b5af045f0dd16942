"""Interface between what is done to robots and the device that reaches them by infrared light.

Implemented by `grid_robots.GridRobots` for a Kilogrid. `via.open_link` opens what a user names.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import (
    ALL_ROBOTS,
    GAIN_ENTRIES,
    GAINS,
    IN_PROGRAM,
    MOST_READING,
    PAGES_PER_REPORT,
    QUERY_TYPES,
    VITALS,
)

# A voltage that is not known.
_NO_VOLTAGE = MOST_READING
# Places of the upper two bits of three readings, and of the count, in the last byte of VITALS.
_LOW_GAIN_BIT, _HIGH_GAIN_BIT, _COUNT_BIT, _VOLTAGE_BIT = 0, 2, 4, 6
# The state is the lower half of a program's answer, the question the upper one.
_STATE_BITS = 4


class MessageType(IntEnum):
    """Infrared messages between a host and boot loaders (boot_loaders.md 5.1)."""

    BOOT = 0x80
    PAGE = 0x81
    SIZE = 0x82
    CRC = QUERY_TYPES["CRC"]
    QUERY = QUERY_TYPES["QUERY"]
    REPORT = QUERY_TYPES["REPORT"]
    START = QUERY_TYPES["START"]


class LoaderState(IntEnum):
    """State of an image, as the boot loader reports it."""

    NOTHING = 0
    LOADING = 1
    COMPLETE = 2
    WRONG = 3


class RobotState(IntEnum):
    """State of an application's runtime (hardware.md 1.3).

    Numbered as robot_state_t of firmware/kilolib/core/robot_commands.h.
    """

    IDLE = 0
    SETUP = 1
    RUNNING = 2
    SLEEPING = 3
    BATTERY = 4
    CHARGING = 5
    MOVING = 6


def is_of_program(first: int) -> bool:
    """Whether it is a question that applications answer, each at a tick of its own."""
    return VITALS <= first < GAINS + GAIN_ENTRIES


@dataclass(frozen=True)
class Gains:
    """Readings of a robot's two amplifiers, 0 to 1023, as a message of another robot came in."""

    low: int
    high: int


@dataclass(frozen=True)
class Heard:
    """The last answer to VITALS that a robot heard of another, and their number modulo 4."""

    gains: Gains
    count: int


@dataclass(frozen=True)
class Report:
    """A robot's answer to a question; `first` is what was asked."""

    uid: int
    first: int
    content: bytes
    """Four bytes. Bit i: page `first` + i is missing; for IDENTITY the id, for VITALS the voltage
    and what was heard, for GAINS and more an entry of the gain tables.
    """
    state: int
    """Below 16 a LoaderState, else a RobotState, and the lower half of `first` above it."""
    module: tuple[int, int] | None = None
    """Column and row of the module that heard it, and its cell below; None: no grid."""
    cell: int | None = None

    @property
    def in_loader(self) -> bool:
        """Whether the robot is in its boot loader."""
        return self.state < IN_PROGRAM

    @property
    def loader_state(self) -> LoaderState | None:
        """The image's, of a robot in its boot loader; None of others, and for nonsense."""
        return LoaderState(self.state) if self.state in tuple(LoaderState) else None

    @property
    def robot_state(self) -> RobotState | None:
        """The runtime's, of a robot whose application runs; else None."""
        number = self.state % IN_PROGRAM
        is_state = not self.in_loader and number in tuple(RobotState)
        return RobotState(number) if is_state else None

    @property
    def is_late(self) -> bool:
        """Whether it is a program's answer to something that was asked for before."""
        return not self.in_loader and self.state >> _STATE_BITS != self.first % IN_PROGRAM

    @property
    def missing(self) -> frozenset[int]:
        """The pages that it lacks, of those asked for. Not of IDENTITY and VITALS."""
        bits = int.from_bytes(self.content, "little")
        return frozenset(self.first + i for i in range(PAGES_PER_REPORT) if bits >> i & 1)

    @property
    def image_id(self) -> int:
        """Answer to IDENTITY; 0xFFFFFFFF: not known."""
        return int.from_bytes(self.content, "little")

    @property
    def voltage(self) -> int | None:
        """Answer to VITALS: get_voltage()'s reading; None if it is not known."""
        reading = self._number(self.content[0], _VOLTAGE_BIT)
        return None if self.in_loader or reading == _NO_VOLTAGE else reading

    @property
    def heard(self) -> Heard:
        """Answer to VITALS: what the robot's receiver read; zeros if it never heard one."""
        low = self._number(self.content[1], _LOW_GAIN_BIT)
        high = self._number(self.content[2], _HIGH_GAIN_BIT)
        return Heard(Gains(low, high), self.content[3] >> _COUNT_BIT & 3)

    @property
    def entry(self) -> Gains:
        """Answer to GAINS and more: the entry as it stands in the EEPROM; 65535: erased."""
        low, high = self.content[:2], self.content[2:]
        return Gains(int.from_bytes(low, "big"), int.from_bytes(high, "big"))

    def _number(self, lowest: int, highest_bit: int) -> int:
        return lowest | (self.content[3] >> highest_bit & 3) << 8


def slot_of(uid: int, nonce: int, slots_log2: int) -> int:
    """The slot in which a robot answers, 0 to 2^slots_log2 - 1.

    As robot_query_slot() of firmware/kilolib/core/robot_query.h.
    """
    multiplier = (0x9E37 + nonce * 0x6D2A) & 0xFFFF
    hashed = uid * multiplier & 0xFFFF
    return hashed >> (16 - slots_log2) if slots_log2 else 0


class RobotLink(Protocol):
    """A way to robots by infrared. Calls return when the thing is done.

    DeviceError if the device is gone or does not answer. Times are those of the link's clock
    (table/grid/clock.py): real time, or that of an emulated world.
    """

    name: str
    """As the user named it: "ohc:/dev/ttyUSB0", "grid"."""
    verifies: bool
    """Whether robots' answers come back: by a grid of our modules, not by an overhead controller.
    """
    laps_per_place: int
    """Laps until a page has been sent everywhere: 1; 4 for a grid, which sends one by the first
    cell of each module, the next one by the second."""

    def repeat(self, message: bytes, hold_s: float) -> None:
        """Sends a message, 9 data bytes and its type, again and again for so long; then silence."""

    def announce(self, image: FlashImage) -> None:
        """Says which image the pages to come are of, with its CRC and id where that is possible."""

    def send_page(self, page: int, data: bytes) -> None:
        """Sends page `page`, 128 bytes, once. Returns when robots have had it."""

    def ask(self, first: int, slots_log2: int, nonce: int, uid: int = ALL_ROBOTS) -> list[Report]:
        """All answers to one question, when the last slot is over; [] if it does not verify.

        A robot that several modules hear is in it several times. `slots_log2`: 0 to 8.
        """

    def close(self) -> None:
        """Releases the device."""
