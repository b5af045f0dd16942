"""Addresses in Python are those in C, over all identifiers."""

import ctypes

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kilotwin.table.can import address
from kilotwin.table.can.address import Address, AddressType

NO_ID = 0xFFFF


class CAddress(ctypes.Structure):
    _pack_ = 1
    _fields_ = (("x", ctypes.c_uint8), ("y", ctypes.c_uint8), ("type", ctypes.c_uint8))


def c_address_of(library: ctypes.CDLL, identifier: int) -> Address | None:
    read = CAddress()
    library.kilogrid_address.restype = ctypes.c_bool
    library.kilogrid_address.argtypes = [ctypes.c_uint16, ctypes.POINTER(CAddress)]
    if not library.kilogrid_address(identifier, ctypes.byref(read)):
        return None
    return Address(read.x, read.y, AddressType(read.type))


def test_every_identifier_means_the_same_in_c_and_python(protocol_c: ctypes.CDLL) -> None:
    for identifier in range(0x1000):
        expected = c_address_of(protocol_c, identifier)
        if expected is None:
            with pytest.raises(ValueError, match="0x"):
                address.from_id(identifier)
        else:
            assert address.from_id(identifier) == expected
            assert address.to_id(expected) == identifier


@given(x=st.integers(0, 255), y=st.integers(0, 255), kind=st.sampled_from(AddressType))
def test_every_address_has_the_same_identifier_in_c_and_python(
    protocol_c: ctypes.CDLL, x: int, y: int, kind: AddressType
) -> None:
    protocol_c.kilogrid_id.restype = ctypes.c_uint16
    protocol_c.kilogrid_id.argtypes = [CAddress]
    expected = protocol_c.kilogrid_id(CAddress(x, y, kind))
    if expected == NO_ID:
        with pytest.raises(ValueError, match="0 to 30"):
            address.to_id(Address(x, y, kind))
    else:
        assert address.to_id(Address(x, y, kind)) == expected


def test_the_specifications_examples() -> None:
    assert address.to_id(address.ALL_MODULES) == 0
    assert address.to_id(address.row(19)) == 20 << 6
    assert address.to_id(address.column(9)) == 10 << 1
    assert address.to_id(address.module(9, 19)) == 20 << 6 | 10 << 1
    assert address.from_id(20 << 6 | 10 << 1 | 1) == Address(9, 19, AddressType.DISPATCHER)


def test_a_module_listens_to_four_identifiers_which_are_its_own_in_c_too(
    protocol_c: ctypes.CDLL,
) -> None:
    ids = (ctypes.c_uint16 * 4)()
    for x, y in ((0, 0), (9, 19), (30, 30)):
        protocol_c.kilogrid_filters(x, y, ids)
        taken = (address.ALL_MODULES, address.row(y), address.column(x), address.module(x, y))
        assert tuple(ids) == tuple(map(address.to_id, taken))


def test_addresses_read_as_people_say_them() -> None:
    texts = [str(address.from_id(i)) for i in (0, 0x040, 0x002, 0x042, 0x043)]
    assert texts == [
        "all modules",
        "row 0",
        "column 0",
        "module (0, 0)",
        "the host, from module (0, 0)",
    ]
