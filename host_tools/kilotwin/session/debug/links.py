"""Links from the process that leads to the worlds that it has forked: lines of JSON on sockets that
are all made before the first world, since a confined process makes none."""

import json
import os
import socket
from typing import Any

from kilotwin.errors import RunError

Message = dict[str, Any]

_MOST_BYTES = 1 << 20
GONE = "the world's process has ended"


class GoneError(RunError):
    """The process at the other end has ended, or sends what is no message."""


class Link:
    """One end of a link."""

    def __init__(self, end: socket.socket) -> None:
        self._end = end
        self._bytes = bytearray()

    def fileno(self) -> int:
        """For select()."""
        return self._end.fileno()

    def send(self, message: Message) -> None:
        """Sends it whole; GoneError if the other end is closed."""
        left = memoryview(json.dumps(message).encode() + b"\n")
        try:
            while left:
                left = left[os.write(self._end.fileno(), left) :]
        except OSError:
            raise GoneError(GONE) from None

    def receive(self) -> Message:
        """Waits for the next; GoneError if none comes any more."""
        while (end := self._bytes.find(b"\n")) < 0:
            try:
                data = os.read(self._end.fileno(), 1 << 16)
            except OSError:
                data = b""
            if not data or len(self._bytes) > _MOST_BYTES:
                raise GoneError(GONE)
            self._bytes += data
        line = bytes(self._bytes[:end])
        del self._bytes[: end + 1]
        try:
            message = json.loads(line)
        except ValueError:
            raise GoneError("a world's process says what is no message") from None
        if not isinstance(message, dict):
            raise GoneError("a world's process says what is no message")
        return message

    def waits(self) -> bool:
        """Whether a part of a message is there already, that select() does not see."""
        return bool(self._bytes)

    def forget(self) -> None:
        """Drops all that has come: a new process gets this link."""
        self._bytes.clear()
        self._end.setblocking(False)
        try:
            while os.read(self._end.fileno(), 1 << 16):
                pass
        except OSError:
            pass
        finally:
            self._end.setblocking(True)

    def close(self) -> None:
        """Closes this end."""
        self._end.close()


def pairs(count: int) -> list[tuple[Link, Link]]:
    """So many links: the leader's end and the world's."""
    made = [socket.socketpair() for _ in range(count)]
    return [(Link(ours), Link(theirs)) for ours, theirs in made]
