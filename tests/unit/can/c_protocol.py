"""The C side of the protocol as Python objects."""

import ctypes
import re
from typing import Any

from kilotwin.files import resources

HEADER = resources.made() / "kilogrid_can.h"
C_TYPES = {"uint8_t": ctypes.c_uint8, "uint16_t": ctypes.c_uint16, "uint32_t": ctypes.c_uint32}


def snake(name: str) -> str:
    """The C member of a signal: IrData0 is ir_data0."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def structure(message: str) -> type[ctypes.Structure]:
    """The generated struct of "to_module" or "to_host", packed as modules have it."""
    text = HEADER.read_text(encoding="utf-8")
    body = re.search(rf"struct kilogrid_can_{message}_t {{(.*?)^}};", text, re.S | re.M)
    assert body is not None
    members = re.findall(r"^ {4}(uint\d+_t) (\w+);", body[1], re.M)
    fields = [(name, C_TYPES[kind]) for kind, name in members]
    return type(message, (ctypes.Structure,), {"_pack_": 1, "_fields_": fields})


class Codec:
    """pack() and unpack() of one message."""

    def __init__(self, library: ctypes.CDLL, message: str) -> None:
        self.structure = structure(message)
        self._pack = getattr(library, f"kilogrid_can_{message}_pack")
        self._unpack = getattr(library, f"kilogrid_can_{message}_unpack")
        for function in (self._pack, self._unpack):
            function.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t]

    def pack(self, signals: dict[str, int]) -> bytes:
        struct = self.structure(**{snake(name): value for name, value in signals.items()})
        data = ctypes.create_string_buffer(8)
        assert self._pack(data, ctypes.byref(struct), 8) == 8
        return data.raw

    def unpack(self, data: bytes, names: list[str]) -> dict[str, int]:
        struct: Any = self.structure()
        assert self._unpack(ctypes.byref(struct), data.ljust(8, b"\0"), 8) == 0
        return {name: getattr(struct, snake(name)) for name in names}


class Dropped(ctypes.Structure):
    _pack_ = 1
    _fields_ = (
        ("too_short", ctypes.c_uint16),
        ("out_of_range", ctypes.c_uint16),
        ("out_of_order", ctypes.c_uint16),
    )


class Config(ctypes.Structure):
    _pack_ = 1
    _fields_ = (
        ("size", ctypes.c_uint8),
        ("next", ctypes.c_uint8),
        ("data", ctypes.c_uint8 * 48),
    )


class Infrared(ctypes.Structure):
    _pack_ = 1
    _fields_ = (
        ("has_first", ctypes.c_bool),
        ("type", ctypes.c_uint8),
        ("data", ctypes.c_uint8 * 9),
    )


class Page(ctypes.Structure):
    _pack_ = 1
    _fields_ = (
        ("pages", ctypes.c_uint8),
        ("page", ctypes.c_uint8),
        ("next", ctypes.c_uint8),
        ("checked", ctypes.c_bool),
        ("check_due", ctypes.c_bool),
        ("check", ctypes.c_uint8 * 6),
        ("data", ctypes.c_uint8 * 128),
    )


class Transfer(ctypes.Structure):
    """transfer_t, packed as modules have it."""

    _pack_ = 1
    _fields_ = (
        ("config", Config),
        ("ir", Infrared),
        ("kilo", Page),
        ("own", Page),
        ("own_pages", ctypes.c_uint8 * 28),
        ("dropped", Dropped),
    )


EVENTS = (
    "NOT_MINE",
    "GOES_ON",
    "REFUSED",
    "CONFIG_BEGUN",
    "CONFIG_DONE",
    "IR_DONE",
    "PAGE_BEGUN",
    "PAGE_DONE",
    "OWN_PAGE_DONE",
    "ANNOUNCED",
)


class Receiver:
    """A module that takes transfers."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self.library = library
        self.state = Transfer()
        library.transfer_receive.restype = ctypes.c_uint8
        library.transfer_own_pages_missing.restype = ctypes.c_uint8
        library.transfer_init(ctypes.byref(self.state))

    def receive(self, data: bytes) -> str:
        """The event of a frame with these data bytes, without its prefix."""
        event: int = self.library.transfer_receive(ctypes.byref(self.state), data, len(data))
        return EVENTS[event]

    def own_pages_missing(self) -> int:
        missing: int = self.library.transfer_own_pages_missing(ctypes.byref(self.state))
        return missing
