"""Buses of python-can as the controller sees them: any interface that python-can knows."""

import errno
from collections import Counter
from collections.abc import Sequence

import can
import numpy as np

from kilotwin.table.grid.links import FRAME, NO_FRAMES, FrameLog, Frames

# python-can hands over one message at a time; a step must come to an end on a bus that never rests.
_MOST_PER_STEP = 4096
# A full queue empties in some milliseconds, unless no node acknowledges its frames.
_FULL_S = 1.0
# A bus of ours may name a longer time: KilogridBus waits for the dispatcher.
_FULL_NAME = "full_s"


class CanLinks:
    """All buses of a grid. Times are those of the caller's clock."""

    def __init__(
        self,
        buses: Sequence[can.BusABC],
        log: FrameLog | None = None,
        *,
        echoes: Sequence[bool] = (),
    ) -> None:
        """`buses[b]` is the grid's bus b.

        `echoes`: which of them also hand back what was sent, in its place among what came.
        """
        self._buses = list(buses)
        self._log = log
        self._troubles: list[str | None] = [None] * len(self._buses)
        self._full_since_s: list[float | None] = [None] * len(self._buses)
        self._echoes = list(echoes) or [False] * len(self._buses)
        self._sent: list[Frames] = []
        self._to_come = [Counter[tuple[int, bytes]]() for _ in self._buses]

    def __len__(self) -> int:
        return len(self._buses)

    def send(self, bus: int, identifier: int, data: bytes, now_s: float) -> bool:
        """Whether the bus took the frame; if its queue is full, send again later."""
        message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        try:
            self._buses[bus].send(message)
        except (can.CanError, OSError) as error:
            if getattr(error, "error_code", None) != errno.ENOBUFS:
                self._troubles[bus] = _reason(error)
            elif (since_s := self._full_since_s[bus]) is None:
                self._full_since_s[bus] = now_s
            elif now_s - since_s > getattr(self._buses[bus], _FULL_NAME, _FULL_S):
                self._troubles[bus] = "nobody acknowledges frames; is it plugged in?"
            return False
        self._troubles[bus] = self._full_since_s[bus] = None
        if self._echoes[bus]:
            self._to_come[bus][identifier, bytes(data)] += 1
        else:
            self._sent.append(_row(now_s, bus, message, from_host=True))
        return True

    def send_all(self, bus: int, identifiers: Sequence[int], data: bytes, now_s: float) -> int:
        """The same bytes to several addresses in turn; how many of them the bus took."""
        for count, identifier in enumerate(identifiers):
            if not self.send(bus, identifier, data, now_s):
                return count
        return len(identifiers)

    def trouble(self, bus: int) -> str | None:
        """Why a bus does not work, if it does not."""
        return self._troubles[bus]

    def receive(self, now_s: float) -> Frames:
        """All frames since the last call in order of time, those that this host sent among them."""
        frames = self._take(now_s)
        if self._log is not None and len(frames):
            self._log.add(frames)
        return frames

    def _take(self, now_s: float) -> Frames:
        rows, self._sent = self._sent, []
        for number, bus in enumerate(self._buses):
            try:
                for _ in range(_MOST_PER_STEP):
                    message = bus.recv(0)
                    if message is None:
                        break
                    if is_data_frame(message):
                        own = self._is_echo(number, message)
                        rows.append(_row(now_s, number, message, from_host=own))
            except (can.CanError, OSError) as error:
                self._troubles[number] = _reason(error)
        return np.concatenate(rows) if rows else NO_FRAMES

    def _is_echo(self, bus: int, message: can.Message) -> bool:
        """Whether it was sent from here, and comes back.

        The kernel tells what its own socket sent, python-can only what any program of this machine
        did, another host among them: so frames on their way back are counted.
        """
        key = message.arbitration_id, bytes(message.data)
        if message.is_rx or self._to_come[bus][key] == 0:
            return False
        self._to_come[bus][key] -= 1
        return True

    def forget_log(self) -> None:
        """Logs no more: where the log is cannot be written."""
        self._log = None

    def close(self) -> None:
        """Shuts the buses down."""
        for bus in self._buses:
            bus.shutdown()


def is_data_frame(message: can.Message) -> bool:
    """Whether it is what a Kilogrid has: a classic data frame with a short identifier."""
    return not (
        message.is_extended_id or message.is_remote_frame or message.is_error_frame or message.is_fd
    )


def _reason(error: Exception) -> str:
    """In one line: python-can puts tracebacks into its own words."""
    cause = error.__cause__ or error
    text = getattr(cause, "strerror", None) or str(cause) or type(cause).__name__
    return text.splitlines()[0].lower()


def _row(at_s: float, bus: int, message: can.Message, *, from_host: bool) -> Frames:
    row = np.zeros(1, dtype=FRAME)
    data = bytes(message.data).ljust(8, b"\0")
    row[0] = (at_s, bus, message.arbitration_id, message.dlc, list(data), from_host)
    return row
