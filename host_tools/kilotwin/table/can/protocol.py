"""Data bytes of a Kilogrid's CAN frames, encoded and decoded by kilogrid.dbc.

Modules and emulator compile C made from the same file. Frames to modules are made by `to_module`
and its short forms; frames to the host are read by `read_to_host`.
"""

import functools
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any, cast

from kilotwin.files import resources

if TYPE_CHECKING:
    from cantools.database.can import Database, Message

DBC = "kilogrid_modules/protocol/kilogrid.dbc"
FRAME_BYTES = 8

# Frames that are sent with fewer bytes, and how many a frame to the host must have at least: see
# kilogrid_modules/protocol/address.c, a test compares.
_SHORT_TO_MODULE = {"TRACKING_REQ": 1, "MODULE_DATA": 2}
_LEAST_TO_HOST = {
    "TRACKING_KILOBOT": 8,
    "MODULE_DATA": 8,
    "TRACKING_KILOBOT_START": 2,
    "MODULE_BOOT_REPORT": 8,
    "ROBOT_REPORT": 8,
    "HOST_PRESENT": 8,
}

_TYPE_TO_HOST_MASK = 0x3F


class FrameError(ValueError):
    """A frame that no node sends: wrong length, unknown type, a value out of range."""


class ModuleState(IntEnum):
    """As a module reports it; see `State` in the DBC."""

    INIT = 0
    IDLE = 1
    SETUP_KILOBOTS = 2
    WAITING_FOR_BOOTPAGE = 3
    BOOTLOADING_KILOBOTS = 4
    WAITING_FOR_CONFIGURATION = 5
    SETUP = 6
    RUNNING = 7
    BOOTLOADER = 8


class HealthPart(IntEnum):
    """Which answer a health request is for."""

    MODULE = 0
    BUS = 1


@dataclass(frozen=True, slots=True)
class Records:
    """The answer to a poll: so many `Tracking` follow."""

    count: int


@dataclass(frozen=True, slots=True)
class Tracking:
    """A report of a robot through a cell."""

    cell: int
    """0 top left, 1 top right, 2 bottom left, 3 bottom right."""
    data: bytes
    """The robot program's 7 bytes."""


@dataclass(frozen=True, slots=True)
class Health:
    """A module's answer to a health request; only modules with our firmware answer."""

    state: ModuleState
    config_size: int
    config_crc: int
    """CRC-16/MCRF4XX of the configuration it holds; 65535 for none."""
    lost_records: int
    refused_frames: int


@dataclass(frozen=True, slots=True)
class BusHealth:
    """Error counters of a module's CAN controller, its uptime and firmware version."""

    transmit_errors: int
    receive_errors: int
    uptime_s: int
    version: int


@dataclass(frozen=True, slots=True)
class BootReport:
    """A module's boot loader about the program that it takes; docs/boot_loaders.md 5.2."""

    first: int
    """As in the question: a page, or 0xE0 for the image's id."""
    missing: int
    """Bit i: page first + i is missing, 32 of them; or the id."""
    state: int
    """0 no program, 1 loading, 2 complete, 3 complete but wrong."""
    id_low: int
    """The lowest byte of the image's id."""


@dataclass(frozen=True, slots=True)
class RobotReport:
    """A robot's answer to a question, through a cell; docs/boot_loaders.md 5.1."""

    cell: int
    uid: int
    answer: int
    """32 bits, as asked: pages that are missing, the image's id, or the voltage in the lower 16."""
    state: int
    """Below 16 that of its boot loader (as `BootReport.state`), else 16 more than its program's."""


@dataclass(frozen=True, slots=True)
class UserFrame:
    """A frame that a module program sends by itself: all its bytes, the first one its type."""

    data: bytes


@dataclass(frozen=True, slots=True)
class HostPresent:
    """A host says that it is there; docs/wire.md."""

    drawn: bytes
    """7 bytes by which it knows its own."""


ToHost = (
    HostPresent | Records | Tracking | Health | BusHealth | BootReport | RobotReport | UserFrame
)


@functools.cache
def database() -> "Database":
    """The DBC, as cantools sees it. Loads on first use: cantools takes a third of a second."""
    from cantools.database import load_file

    return cast("Database", load_file(resources.path(DBC), cache_dir=None))


def _cantools_error() -> type[Exception]:
    from cantools.database.errors import Error

    return Error


@functools.cache
def _message(name: str) -> "Message":
    return database().get_message_by_name(name)


@functools.cache
def _types(message: str) -> dict[str, int]:
    choices = _message(message).get_signal_by_name("Type").choices
    return {str(name): number for number, name in choices.items()} if choices else {}


def types_to_module() -> dict[str, int]:
    """Names and numbers of the frames to modules."""
    return dict(_types("ToModule"))


def types_to_host() -> dict[str, int]:
    """Names and numbers of the frames to the host."""
    return dict(_types("ToHost"))


def least_dlc_to_host(name: str) -> int:
    """How many bytes a frame of this type has at least; ours to the host have no more."""
    return _LEAST_TO_HOST.get(name, 1)


def dlc_to_module(name: str) -> int:
    """How many bytes a frame of this type is sent with."""
    return _SHORT_TO_MODULE.get(name, FRAME_BYTES)


def to_module(name: str, **signals: int) -> bytes:
    """The data bytes of a frame to modules; `name` and `signals` as in the DBC.

    FrameError if the type is unknown, a signal is missing, not of this type, or out of range.
    """
    number = _types("ToModule").get(name)
    if number is None:
        raise FrameError(f"there is no frame {name} to modules")
    try:
        data = _message("ToModule").encode({"Type": number, **signals})
    except (_cantools_error(), KeyError) as error:
        raise FrameError(f"{name}: {error}") from None
    return data[: dlc_to_module(name)]


def health_request(part: HealthPart = HealthPart.MODULE) -> bytes:
    """The frame that requests a module's health. An original module passes it to its program."""
    return to_module("MODULE_DATA", HealthPart=part)


def host_present(drawn: bytes) -> bytes:
    """The frame by which a host says that it is there; `drawn` are its 7 bytes."""
    if len(drawn) != FRAME_BYTES - 1:
        raise FrameError(f"HOST_PRESENT has {FRAME_BYTES - 1} bytes behind its type")
    return bytes([_types("ToHost")["HOST_PRESENT"]]) + drawn


def read_to_module(data: bytes) -> dict[str, int | str]:
    """The signals of a frame to modules, for people: `Type` as a name if it has one.

    What lies beyond the frame's bytes reads 0. An unlisted type has no other signals.
    """
    return _readable("ToModule", data, 0xFF)


def signals_to_host(data: bytes) -> dict[str, int | str]:
    """The same of a frame to the host."""
    return _readable("ToHost", data, _TYPE_TO_HOST_MASK)


def _readable(message: str, data: bytes, mask: int) -> dict[str, int | str]:
    if not 0 < len(data) <= FRAME_BYTES:
        raise FrameError(f"a frame has 1 to {FRAME_BYTES} data bytes, not {len(data)}")
    try:
        signals = _decode(message, data, names=True)
    except (_cantools_error(), KeyError):
        return {"Type": data[0] & mask}
    return {
        name: value if isinstance(value, int) else str(value) for name, value in signals.items()
    }


def _decode(message: str, data: bytes, *, names: bool) -> dict[str, Any]:
    padded = bytes(data).ljust(FRAME_BYTES, b"\0")
    signals = _message(message).decode(padded, decode_choices=names, scaling=False)
    return cast(dict[str, Any], signals)


@functools.cache
def _names_to_host() -> dict[int, str]:
    return {number: name for name, number in _types("ToHost").items()}


def read_to_host(data: bytes) -> ToHost:
    """A module's frame to the host, decoded. FrameError for one that no module sends."""
    if not 0 < len(data) <= FRAME_BYTES:
        raise FrameError(f"a frame has 1 to {FRAME_BYTES} data bytes, not {len(data)}")
    name = _names_to_host().get(data[0] & _TYPE_TO_HOST_MASK)
    if name is None or name in ("MODULE_USER", "KILOBOT_DATA"):
        return UserFrame(bytes(data))
    if len(data) < least_dlc_to_host(name):
        raise FrameError(f"{name} has {least_dlc_to_host(name)} bytes, not {len(data)}")
    try:
        signals = _decode("ToHost", data, names=False)
        match name:
            case "TRACKING_KILOBOT":
                return Tracking(signals["Cell"], bytes(data[1:]))
            case "TRACKING_KILOBOT_START":
                return Records(signals["Records"])
            case "MODULE_BOOT_REPORT":
                wanted = ("First", "Missing", "LoaderState", "IdLow")
                return BootReport(*(signals[key] for key in wanted))
            case "HOST_PRESENT":
                return HostPresent(bytes(data[1:]))
            case "ROBOT_REPORT":
                wanted = ("Cell", "Uid", "Answer", "RobotState")
                return RobotReport(*(signals[key] for key in wanted))
            case _:
                return _health(signals)
    except (_cantools_error(), KeyError, ValueError) as error:
        raise FrameError(f"{name}: {error}") from None


def _health(signals: dict[str, int]) -> Health | BusHealth:
    if signals["HealthPart"] == HealthPart.MODULE:
        return Health(
            ModuleState(signals["State"]),
            signals["ConfigSize"],
            signals["ConfigCrc"],
            signals["LostRecords"],
            signals["RefusedFrames"],
        )
    return BusHealth(
        signals["TransmitErrors"], signals["ReceiveErrors"], signals["Uptime"], signals["Version"]
    )
