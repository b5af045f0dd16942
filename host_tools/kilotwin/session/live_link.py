"""The run's end of the socket between a run and its viewer's process.

A message is its length in four bytes, little-endian, and so many bytes. To the run come orders,
each a JSON object; from it go moments and answers, packed (packing.py). The run never waits for the
other side: what that does not take is kept, and it gets no new moment before.
"""

import json
import os
import select
import struct
from typing import Any

LENGTH = struct.Struct("<I")
MOST_ORDER_BYTES = 1 << 16
_READ_BYTES = 1 << 16


class LiveLink:
    """Orders from a viewer, moments and answers to it."""

    def __init__(self, descriptor: int) -> None:
        """`descriptor`: of the socket; it is made not to block."""
        os.set_blocking(descriptor, False)
        self._descriptor = descriptor
        self._come = bytearray()
        self._going = bytearray()
        self.closed = False
        """Whether the viewer is gone."""

    @property
    def is_free(self) -> bool:
        """Whether the other side has taken all that it was sent."""
        return not self._going

    def orders(self) -> list[dict[str, Any]]:
        """The orders that have come, in order; what is none ends the link."""
        while not self.closed and len(self._come) < MOST_ORDER_BYTES:
            try:
                data = os.read(self._descriptor, _READ_BYTES)
            except BlockingIOError:
                break
            except OSError:
                data = b""
            self.closed = not data
            self._come += data
        try:
            return self._whole()
        except ValueError:
            self.closed = True
            return []

    def _whole(self) -> list[dict[str, Any]]:
        found = []
        while len(self._come) >= LENGTH.size:
            (length,) = LENGTH.unpack_from(self._come)
            if length > MOST_ORDER_BYTES:
                raise ValueError("too long")
            if len(self._come) < LENGTH.size + length:
                break
            order = json.loads(self._come[LENGTH.size : LENGTH.size + length])
            del self._come[: LENGTH.size + length]
            if not isinstance(order, dict):
                raise ValueError("no object")
            found.append(order)
        return found

    def send(self, packed: bytes) -> None:
        """Sends a message, as far as the other side takes it now."""
        self._going += LENGTH.pack(len(packed)) + packed
        self.flush()

    def flush(self) -> None:
        """Sends on what is left."""
        try:
            while self._going and not self.closed:
                del self._going[: os.write(self._descriptor, self._going)]
        except BlockingIOError:
            pass
        except OSError:
            self.closed = True
        if self.closed:
            self._going.clear()

    def wait(self, seconds: float, *others: int) -> None:
        """Until something comes, here or at `others`, or can go; not longer than `seconds`."""
        mine = [] if self.closed else [self._descriptor]
        going = mine if self._going else []
        select.select([*mine, *others], going, [], max(0.0, seconds))
