"""Packets on the serial lines of overhead controller and dispatcher (hardware.md 1.11, 3.5).

To the device a packet has 132 bytes: 0x55, type, 129 data bytes, and a checksum that makes the XOR
of all bytes 0. Only CONTINUE, for the dispatcher, has three: it has no data. The dispatcher
sends 4 bytes (0x55, type, number, checksum), and reports of robots in a packet of their own form.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from functools import reduce
from operator import xor

from kilotwin.files.headers import PAGE_BYTES

OVERHEAD_BAUD = 38_400
BIG_BAUD, SMALL_BAUD = 256_000, 38_400
"""Dispatchers of large grids, and of those with up to SMALL_MODULES (hardware.md 3.1)."""
SMALL_MODULES = 16
HEADER = 0x55
DATA_BYTES = PAGE_BYTES + 1
PACKET_BYTES = DATA_BYTES + 3
MESSAGE_BYTES = 10
"""An infrared message without its CRC: 9 data bytes and the type."""
RAW_MESSAGE_BYTES = 12
"""With the CRC."""

_CONTINUE_BYTES = 3
_SHORT_BYTES = 4
_RECORD_BYTES = 15
MOST_RECORDS = 40
"""Reports in one packet of the dispatcher: so many has its buffer."""


class Overhead(IntEnum):
    """Types of packets to an overhead controller."""

    STOP = 0
    LEDTOGGLE = 1
    FORWARDMSG = 2
    """A message, repeated until the next packet."""
    FORWARDRAWMSG = 3
    """The same with its CRC as it is given."""
    BOOTPAGE = 4
    """A page's number and its bytes: 22 frames back to back."""
    GPSFRAME = 5
    """Up to 16 records of 8 bytes, each a frame of type GPS; one of zeros ends them."""
    FORWARDMSGSINGLE = 6
    """A message, once."""


class Dispatched(IntEnum):
    """Types of packets to and from a dispatcher."""

    STOP = 0
    LEDTOGGLE = 1
    KILO_FORWARD_IR_MSG = 2
    KILO_BOOTPAGE = 3
    KILOGRID_COMMAND = 4
    MODULE_FORWARD_CAN_MSG = 5
    MODULE_BOOTPAGE = 6
    MODULE_CONFIGURATION = 7
    TRACKING = 8
    KILO_PROGRAM_SIZE = 9
    MODULE_BOOTLOAD_START = 10
    MODULE_BOOTLOAD_GET_PAGE = 11
    KILO_BOOTLOAD_START = 12
    KILO_BOOTLOAD_GET_PAGE = 13
    DISPATCHER_CONTINUE = 14
    DISPATCHER_AVAILABLE = 15


class GridCommand(IntEnum):
    """First data byte of KILOGRID_COMMAND."""

    STOP_IR = 0xC0
    IDLE = 0xC1
    SETUP = 0xC2
    RUN = 0xC3
    """Columns, rows and reports per packet follow."""
    PAUSE = 0xC4
    BOOTLOAD = 0xC5


@dataclass(frozen=True)
class Packet:
    """A packet to a device, of a type of `Overhead` or `Dispatched`: 129 data bytes."""

    type: int
    data: bytes


@dataclass(frozen=True)
class Record:
    """A robot's report as the dispatcher passes it on."""

    x: int
    y: int
    cell: int
    data: bytes
    """The robot program's 7 bytes."""
    ticks: int
    """Since RUN, by the dispatcher's clock."""
    address_type: int = 3


@dataclass(frozen=True)
class Notice:
    """A short packet from the dispatcher: AVAILABLE, or a request for page `number`."""

    type: int
    number: int


@dataclass(frozen=True)
class Tracking:
    """A packet of reports."""

    records: tuple[Record, ...]


CONTINUE = bytes([HEADER, Dispatched.DISPATCHER_CONTINUE, HEADER ^ Dispatched.DISPATCHER_CONTINUE])
"""Lets a dispatcher that is AVAILABLE go on."""


def checksum(data: bytes) -> int:
    """XOR of all bytes."""
    return reduce(xor, data, 0)


def encode(kind: int, data: bytes = b"") -> bytes:
    """A packet to the device; `data` is filled up with zeros. ValueError if it is too long."""
    if len(data) > DATA_BYTES:
        raise ValueError(f"a packet has {DATA_BYTES} data bytes, not {len(data)}")
    body = bytes([HEADER, kind]) + data.ljust(DATA_BYTES, b"\0")
    return body + bytes([checksum(body)])


def encode_page(kind: int, page: int, content: bytes) -> bytes:
    """A packet with a page of 128 bytes; ValueError if it is none."""
    if len(content) != PAGE_BYTES:
        raise ValueError(f"a page has {PAGE_BYTES} bytes, not {len(content)}")
    return encode(kind, bytes([page]) + content)


def encode_notice(notice: Notice) -> bytes:
    """The dispatcher's side: a short packet to the PC."""
    body = bytes([HEADER, notice.type, notice.number])
    return body + bytes([checksum(body)])


def encode_tracking(tracking: Tracking) -> bytes:
    """The dispatcher's side: reports. Their checksum is that of the records alone."""
    records = b"".join(
        bytes([r.x, r.y, r.address_type, r.cell]) + r.data + r.ticks.to_bytes(4, "little")
        for r in tracking.records
    )
    head = bytes([HEADER, Dispatched.TRACKING, len(tracking.records)])
    return head + records + bytes([checksum(records)])


class _Stream:
    """Bytes of a line, cut into packets. What begins no packet is passed over byte by byte."""

    def __init__(self) -> None:
        self._waiting = bytearray()
        self.junk = 0
        """Bytes that were part of no packet: noise, or a packet with bytes lost or changed."""

    def _cut(self, data: bytes, *, silent: bool = False) -> Iterator[bytes]:
        """Adds `data`; yields each whole packet. `silent`: what is not complete never will be."""
        self._waiting += data
        while self._waiting:
            length = self._length() if self._waiting[0] == HEADER else None
            if length == 0 and not silent:
                return
            if not length or not self._is_whole(bytes(self._waiting[:length])):
                self.junk += 1
                del self._waiting[0]
                continue
            packet = bytes(self._waiting[:length])
            del self._waiting[:length]
            yield packet

    def _length(self) -> int | None:
        """Bytes of the packet that begins here; 0 if more has to come, None if there is none."""
        raise NotImplementedError

    def _is_whole(self, packet: bytes) -> bool:
        return checksum(packet) == 0


class ToDevice(_Stream):
    """The device's side: finds packets in the bytes of a host."""

    def take(self, data: bytes) -> list[Packet]:
        """The packets that are complete with `data`."""
        return [Packet(packet[1], packet[2:-1]) for packet in self._cut(data)]

    def _length(self) -> int | None:
        if len(self._waiting) > 1 and self._waiting[1] not in tuple(Dispatched):
            return None
        short = self._waiting[: len(CONTINUE)] == CONTINUE[: len(self._waiting)]
        length = _CONTINUE_BYTES if short and len(self._waiting) > 1 else PACKET_BYTES
        return length if len(self._waiting) >= length else 0


_NOTICES = (
    Dispatched.MODULE_BOOTLOAD_GET_PAGE,
    Dispatched.KILO_BOOTLOAD_GET_PAGE,
    Dispatched.DISPATCHER_AVAILABLE,
)


class FromDispatcher(_Stream):
    """The host's side: finds packets in the bytes of a dispatcher. Text that it prints is junk."""

    def take(self, data: bytes) -> list[Notice | Tracking]:
        """The packets that are complete with `data`."""
        return [_read(packet) for packet in self._cut(data)]

    def take_rest(self) -> list[Notice | Tracking]:
        """Those that stand behind the begin of one whose rest is lost: the line is silent."""
        return [_read(packet) for packet in self._cut(b"", silent=True)]

    def _length(self) -> int | None:
        if len(self._waiting) < _SHORT_BYTES:
            return 0
        kind, number = self._waiting[1:3]
        length = _SHORT_BYTES
        if kind == Dispatched.TRACKING and number <= MOST_RECORDS:
            length += number * _RECORD_BYTES
        elif kind not in _NOTICES:
            return None
        return length if len(self._waiting) >= length else 0

    def _is_whole(self, packet: bytes) -> bool:
        return checksum(packet[3:] if packet[1] == Dispatched.TRACKING else packet) == 0


def _read(packet: bytes) -> Notice | Tracking:
    if packet[1] != Dispatched.TRACKING:
        return Notice(packet[1], packet[2])
    records = (packet[at : at + _RECORD_BYTES] for at in range(3, len(packet) - 1, _RECORD_BYTES))
    return Tracking(
        tuple(
            Record(r[0], r[1], r[3], r[4:11], int.from_bytes(r[11:], "little"), r[2])
            for r in records
        )
    )
