"""`can.log`: every frame that was on the buses, as `candump -L` writes it.

    (1700000000.123456) can0 043#14

Frames of an emulated grid come by the million, so lines are made by the thousand, without a loop.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kilotwin.table.grid.links import Frames

_BATCH = 8192

Bytes = NDArray[np.uint8]


def _table(form: str, count: int) -> Bytes:
    """The characters of 0 to count - 1, a row each."""
    text = "".join(form.format(number) for number in range(count))
    return np.frombuffer(text.encode(), dtype=np.uint8).reshape(count, -1)


# Four digits, since the 10 of seconds are 4 + 3 + 3; where three are wanted the first is left out.
_DIGITS = _table("{:04d}", 10_000)
_BYTES = _table("{:02X}", 256)
_IDS = _table("{:03X}", 2048)


class CanLog:
    """Writes the log. What was added before a `flush` is kept whenever the writer is killed."""

    def __init__(self, file: Path, names: Sequence[str], *, zero_s: float) -> None:
        """`names` of the buses; `zero_s` is added to frames' times, so that none is below 0."""
        self._file = file.open("wb", buffering=0)
        self._zero_s = zero_s
        width = max(map(len, names))
        padded = [name.encode().ljust(width, b"\0") for name in names]
        self._names = np.frombuffer(b"".join(padded), dtype=np.uint8).reshape(len(names), width)
        self._waiting: list[Frames] = []
        self._count = 0

    def add(self, frames: Frames) -> None:
        """Frames in order of time."""
        self._waiting.append(frames)
        self._count += len(frames)
        if self._count >= _BATCH:
            self.flush()

    def flush(self) -> None:
        """Hands all lines to the system."""
        if self._count:
            self._file.write(self._lines(np.concatenate(self._waiting)))
        self._waiting, self._count = [], 0

    def forget(self) -> None:
        """Drops what was not flushed."""
        self._waiting, self._count = [], 0

    def close(self) -> None:
        """Ends the log."""
        self.flush()
        self._file.close()

    def _lines(self, frames: Frames) -> bytes:
        micros = np.rint((frames["at_s"] + self._zero_s) * 1e6).astype(np.int64)
        seconds = micros // 1_000_000
        micros -= seconds * 1_000_000
        data = np.take(_BYTES, frames["data"], axis=0).reshape(len(frames), -1)
        data[np.arange(data.shape[1]) >= 2 * frames["dlc"][:, None]] = 0
        parts: list[bytes | Bytes] = [
            b"(",
            np.take(_DIGITS, seconds // 1_000_000, axis=0),
            np.take(_DIGITS, seconds // 1_000 % 1_000, axis=0)[:, 1:],
            np.take(_DIGITS, seconds % 1_000, axis=0)[:, 1:],
            b".",
            np.take(_DIGITS, micros // 1_000, axis=0)[:, 1:],
            np.take(_DIGITS, micros % 1_000, axis=0)[:, 1:],
            b") ",
            np.take(self._names, frames["bus"], axis=0),
            b" ",
            np.take(_IDS, frames["id"], axis=0),
            b"#",
            data,
            b"\n",
        ]
        lines = np.empty((len(frames), sum(map(_width, parts))), dtype=np.uint8)
        at = 0
        for part in parts:
            same = isinstance(part, bytes)
            lines[:, at : at + _width(part)] = np.frombuffer(part, np.uint8) if same else part
            at += _width(part)
        text = lines[lines != 0]
        return bytes(text)


def _width(part: bytes | Bytes) -> int:
    return len(part) if isinstance(part, bytes) else part.shape[1]
