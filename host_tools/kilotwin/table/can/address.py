"""The 11-bit arbitration identifier of a CAN frame is an address in the grid.

The rules are those of kilogrid_modules/protocol/address.h; a test compares the two over all
identifiers.
"""

import functools
from enum import IntEnum
from typing import NamedTuple

COORDINATE_MAX = 30
"""Largest column and row: their fields have 5 bits, and 0 means "all"."""

MODULE_MASK = 0x7FF

HOST_ID = 0x001
"""Identifier of a host's own HOST_PRESENT: to the host, from no module. No module takes it."""

SOCKETCAND_PORT = 29536
"""TCP port of a socketcand server, unless another is named."""

_TO_HOST = 0x001
_X_SHIFT, _Y_SHIFT, _FIELD = 1, 6, 0x1F


class AddressType(IntEnum):
    """As the lab's module API numbers them."""

    BROADCAST = 0
    ROW = 1
    COLUMN = 2
    INDIVIDUAL = 3
    DISPATCHER = 0xFF
    """From a module to the host, which once was the dispatcher."""


class Address(NamedTuple):
    """Column x and row y, both from 0; an unused coordinate is 0."""

    x: int
    y: int
    type: AddressType

    def __str__(self) -> str:
        match self.type:
            case AddressType.BROADCAST:
                return "all modules"
            case AddressType.ROW:
                return f"row {self.y}"
            case AddressType.COLUMN:
                return f"column {self.x}"
            case AddressType.INDIVIDUAL:
                return f"module ({self.x}, {self.y})"
            case AddressType.DISPATCHER:
                return f"the host, from module ({self.x}, {self.y})"


ALL_MODULES = Address(0, 0, AddressType.BROADCAST)


def row(y: int) -> Address:
    return Address(0, y, AddressType.ROW)


def column(x: int) -> Address:
    return Address(x, 0, AddressType.COLUMN)


def module(x: int, y: int) -> Address:
    return Address(x, y, AddressType.INDIVIDUAL)


def _field(value: int, name: str) -> int:
    if not 0 <= value <= COORDINATE_MAX:
        raise ValueError(f"{name} is 0 to {COORDINATE_MAX}, not {value}")
    return value + 1


def to_id(address: Address) -> int:
    """The identifier of `address`; ValueError if a coordinate is out of range."""
    x, y, kind = address
    identifier = 0
    if kind in (AddressType.ROW, AddressType.INDIVIDUAL, AddressType.DISPATCHER):
        identifier |= _field(y, "y") << _Y_SHIFT
    if kind in (AddressType.COLUMN, AddressType.INDIVIDUAL, AddressType.DISPATCHER):
        identifier |= _field(x, "x") << _X_SHIFT
    return identifier | (_TO_HOST if kind == AddressType.DISPATCHER else 0)


@functools.cache
def from_id(identifier: int) -> Address:
    """The address of an 11-bit `identifier`.

    ValueError for what no node sends: more than 11 bits, or to the host without the coordinates of
    a module.
    """
    if not 0 <= identifier <= MODULE_MASK:
        raise ValueError(f"an identifier has 11 bits, unlike 0x{identifier:X}")
    x, y = identifier >> _X_SHIFT & _FIELD, identifier >> _Y_SHIFT & _FIELD
    at = (max(x - 1, 0), max(y - 1, 0))
    if identifier & _TO_HOST:
        if x == 0 or y == 0:
            raise ValueError(f"0x{identifier:03X} goes to the host but comes from no module")
        return Address(*at, AddressType.DISPATCHER)
    if x == 0:
        return Address(*at, AddressType.ROW if y else AddressType.BROADCAST)
    return Address(*at, AddressType.INDIVIDUAL if y else AddressType.COLUMN)
