"""The frames of a run, made once, and where their parts lie in arrays of frames.

`table/can/protocol.py` defines what a frame means, and these numbers come from its DBC too: a run
has too many frames to have each of them decoded.
"""

import functools
from dataclasses import dataclass

import numpy as np

from kilotwin.experiment.spec.grid_layout import Module
from kilotwin.experiment.spec.overhead import DATA_BYTES
from kilotwin.table.can import address, protocol, transfer
from kilotwin.table.can.protocol import HealthPart, ToHost
from kilotwin.table.grid.cover import Group

IDS = address.MODULE_MASK + 1
"""The number of identifiers on a bus."""

Paced = transfer.Paced


@dataclass(frozen=True)
class Fixed:
    """Frames to modules that are always the same, and where the parts of frames to the host lie."""

    STOP: bytes
    IDLE: bytes
    SETUP: bytes
    RUN: bytes
    TRACKING_REQUEST: bytes
    HEALTH_REQUESTS: tuple[bytes, ...]
    START: int
    """Type of the frame that announces reports; likewise the next two."""
    TRACKING: int
    MODULE_DATA: int
    TYPE_MASK: int
    """Mask of the type in a frame's first byte."""
    CELL_SHIFT: int
    """How far left a cell's number lies in the first byte of a report."""
    MOST_RECORDS: int
    """Reports that one answer can announce."""
    START_BYTES: int
    TRACKING_BYTES: int


@functools.cache
def fixed() -> Fixed:
    """Made on first use: the DBC takes a third of a second, and most runs have no grid."""
    types = protocol.types_to_host()
    to_host = protocol.database().get_message_by_name("ToHost")
    kind, cell, records = map(to_host.get_signal_by_name, ("Type", "Cell", "Records"))
    return Fixed(
        STOP=protocol.to_module("FORWARD_IR_MESSAGE_STOP"),
        IDLE=protocol.to_module("MODULE_IDLE"),
        SETUP=protocol.to_module("MODULE_SETUP"),
        RUN=protocol.to_module("MODULE_RUN"),
        TRACKING_REQUEST=protocol.to_module("TRACKING_REQ"),
        HEALTH_REQUESTS=tuple(protocol.health_request(part) for part in HealthPart),
        START=types["TRACKING_KILOBOT_START"],
        TRACKING=types["TRACKING_KILOBOT"],
        MODULE_DATA=types["MODULE_DATA"],
        TYPE_MASK=(1 << kind.length) - 1,
        CELL_SHIFT=cell.start,
        MOST_RECORDS=int(records.maximum or 0),
        START_BYTES=protocol.least_dlc_to_host("TRACKING_KILOBOT_START"),
        TRACKING_BYTES=protocol.least_dlc_to_host("TRACKING_KILOBOT"),
    )


def id_of_group(group: Group) -> int:
    """The identifier of a frame to these modules."""
    if group.x is None and group.y is None:
        return address.to_id(address.ALL_MODULES)
    if group.x is None:
        assert group.y is not None
        return address.to_id(address.row(group.y))
    if group.y is None:
        return address.to_id(address.column(group.x))
    return address.to_id(address.module(group.x, group.y))


def id_from_module(module: Module) -> int:
    """The identifier of a module's frames to the host."""
    return address.to_id(address.Address(*module, address.AddressType.DISPATCHER))


def module_of_id(identifier: int) -> Module:
    """The module that sends frames with this identifier; ValueError if none does."""
    sender = address.from_id(identifier)
    return sender.x, sender.y


def read_answer(frame: np.void) -> tuple[Module, ToHost] | None:
    """A frame to the host, one of FRAME: its module, and what it says; None for nonsense."""
    try:
        said = protocol.read_to_host(frame["data"][: frame["dlc"]].tobytes())
        return module_of_id(int(frame["id"])), said
    except ValueError:
        return None


def forward(message: bytes) -> list[Paced]:
    """A message for robots, nine bytes and a type, which modules repeat on all cells."""
    return transfer.infrared(message[:DATA_BYTES], message[DATA_BYTES])


def configuration(data: bytes) -> list[Paced]:
    """The frames of a module's configuration, 1 to 48 bytes."""
    return transfer.configuration(data)
