"""An overhead controller as published: packets in, infrared frames out (hardware.md 1.11).

It has no clock of its own: the caller says what came and what time it is. A packet takes its time
on the line, however fast its bytes come. One thing is kinder than the original, which is deaf while
it sends a page: what comes then waits for its turn.
"""

import random
from collections import deque
from collections.abc import Iterator

from kilotwin.experiment.spec.overhead import message
from kilotwin.files.headers import FRAGMENT_BYTES, PAGE_BYTES
from kilotwin.files.message_crc import message_crc
from kilotwin.table.links.packets import (
    MESSAGE_BYTES,
    OVERHEAD_BAUD,
    PACKET_BYTES,
    RAW_MESSAGE_BYTES,
    Overhead,
    Packet,
    ToDevice,
)
from kilotwin.table.links.robot_link import MessageType

_PACKET_S = PACKET_BYTES * 10 / OVERHEAD_BAUD
_FRAME_S = 130 * 33.625e-6
# Its program needs some time between two frames, and 6 ms longer to blink.
_BACK_TO_BACK_S = _FRAME_S + 80e-6
_REPEAT_S = 0.0104
# After a page it blinks for 20 ms.
_AFTER_PAGE_S = 0.020
_GPS_TYPE, _GPS_BYTES = 1, 8

Frame = tuple[float, bytes]
"""When it begins, in the caller's seconds, and its 12 bytes with the CRC."""


def phase_s(seed: int, controller: int) -> float:
    """How much later than the first one's the frames of a controller begin that got its packet at
    the same time, in seconds. A guess: below a millisecond, but never in step, since the light of
    two in step adds up at a chip to one frame."""
    if controller == 0:
        return 0.0
    # Only random() of Python's generator is the same for ever.
    chance = random.Random(f"overhead controller {controller} {seed}").random()
    return (0.1 + 0.9 * chance) * 1e-3


class EmulatedOverhead:
    """The controller's program. Its frames begin `later_s` later: its phase_s()."""

    def __init__(self, later_s: float = 0.0) -> None:
        self._later_s = later_s
        self._stream = ToDevice()
        self._packets: deque[tuple[float, Packet]] = deque()
        self._line_free_s = float("-inf")
        self._burst: deque[bytes] = deque()
        self._repeated: bytes | None = None
        self._next_s = float("-inf")
        self.packets = 0
        """So many have come."""

    @property
    def junk(self) -> int:
        """Bytes that were part of no packet."""
        return self._stream.junk

    def take(self, data: bytes, now_s: float) -> None:
        """Bytes of the line. A packet is there at once, but not sooner than after the last one."""
        for packet in self._stream.take(data):
            self.packets += 1
            at_s = max(now_s, self._line_free_s)
            self._line_free_s = at_s + _PACKET_S
            self._packets.append((at_s, packet))

    def frames(self, begin_s: float, end_s: float) -> list[Frame]:
        """The frames of [begin_s, end_s), which is where the last call ended."""
        return [(at_s + self._later_s, frame) for at_s, frame in self._frames(begin_s, end_s)]

    def _frames(self, begin_s: float, end_s: float) -> Iterator[Frame]:
        self._next_s = max(self._next_s, begin_s)
        while self._next_s < end_s:
            if self._burst:
                yield self._next_s, self._burst.popleft()
                self._next_s += _BACK_TO_BACK_S
                if not self._burst:
                    self._next_s += _AFTER_PAGE_S
            elif self._packets and self._packets[0][0] <= self._next_s:
                yield from self._obey(self._packets.popleft()[1])
            elif self._repeated is not None:
                yield self._next_s, self._repeated
                self._next_s += _REPEAT_S
            elif self._packets:
                self._next_s = self._packets[0][0]
            else:
                return

    def _obey(self, packet: Packet) -> Iterator[Frame]:
        self._repeated = None
        data = packet.data
        match packet.type:
            case Overhead.FORWARDMSG:
                self._repeated = _with_crc(data[:MESSAGE_BYTES])
            case Overhead.FORWARDRAWMSG:
                self._repeated = data[:RAW_MESSAGE_BYTES]
            case Overhead.FORWARDMSGSINGLE:
                yield self._next_s, _with_crc(data[:MESSAGE_BYTES])
                self._next_s += _REPEAT_S
            case Overhead.BOOTPAGE:
                self._burst.extend(_fragments(data[0], data[1:]))
            case Overhead.GPSFRAME:
                self._burst.extend(_positions(data))


def _with_crc(message_: bytes) -> bytes:
    return message_ + message_crc(message_).to_bytes(2, "little")


def _fragments(page: int, content: bytes) -> Iterator[bytes]:
    for begin in range(0, PAGE_BYTES, FRAGMENT_BYTES):
        # Behind a page's last bytes lies the packet's checksum; here zeros.
        fragment = content[begin : begin + FRAGMENT_BYTES]
        yield _with_crc(message([page, begin // 2, *fragment], MessageType.PAGE))


def _positions(data: bytes) -> Iterator[bytes]:
    for begin in range(0, len(data) - _GPS_BYTES + 1, _GPS_BYTES):
        record = data[begin : begin + _GPS_BYTES]
        if not any(record):
            return
        yield _with_crc(message(record, _GPS_TYPE))
