"""`.kilodat` files: what a Kilogrid's robots reported, as the lab's own tool writes it.

Tab-separated text, a header, a row per report. Times are in units of 32 ticks (1.0486 s), rounded
down. A robot's serial, any word, is looked up by the low 7 bits of the first byte; without a list
of serials those 7 bits are written.
"""

import lzma
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

from kilotwin.errors import InputError
from kilotwin.table.grid.poller import Reports
from kilotwin.units import TICK_S

DATA_BYTES = 7
UNIT_S = 32 * TICK_S
"""The unit of a row's time."""

_HEADER = (
    "modulex",
    "moduley",
    "c",
    "timestamp",
    "kilobot_sn",
    *(f"data{index}" for index in range(DATA_BYTES)),
)
_LEAST_COLUMNS = 5 + 1


@dataclass(frozen=True)
class Report:
    """A report of a robot through a cell (0 to 3) of module (x, y)."""

    x: int
    y: int
    cell: int
    timestamp: int
    serial: str
    data: bytes

    @property
    def time_s(self) -> float:
        """The begin of the time unit in which it came."""
        return self.timestamp * UNIT_S


class Writer:
    """Appends to a file; what was added before a `flush` is kept whenever the writer is killed."""

    def __init__(self, file: Path, serials: Mapping[int, str] | None = None) -> None:
        """Begins the file. `serials`: by the low 7 bits of a report's first byte."""
        self._serials = serials or {}
        self._file: TextIO = file.open("w", newline="")
        self._file.write("\t".join(_HEADER) + "\n")

    def add(self, reports: Reports) -> None:
        """Adds reports, at times since the begin of the run."""
        short = reports.data[:, 0] & 0x7F
        serials = [self._serials.get(number, str(number)) for number in short.tolist()]
        times = np.floor(np.maximum(reports.at_s, 0.0) / UNIT_S).astype(np.int64)
        where = np.column_stack((reports.x, reports.y, reports.cell, times)).tolist()
        rows = zip(where, serials, reports.data.tolist(), strict=True)
        self._file.write(
            "".join(
                "\t".join(map(str, (*place, serial, *data))) + "\n" for place, serial, data in rows
            )
        )

    def flush(self) -> None:
        """Hands all rows to the system."""
        self._file.flush()

    def close(self) -> None:
        """Ends the file."""
        self._file.close()


def read(file: Path) -> list[Report]:
    """All reports of a file, packed by xz or not; InputError names the line that is none."""
    try:
        packed = file.read_bytes()
        text = lzma.decompress(packed) if file.suffix == ".xz" else packed
        lines = text.decode().splitlines()
    except (OSError, UnicodeDecodeError, lzma.LZMAError) as error:
        raise InputError(f"{file}: cannot be read ({error}); name a .kilodat file") from None
    return list(_reports(lines, str(file)))


def _reports(lines: Iterable[str], source: str) -> Iterator[Report]:
    for number, line in enumerate(lines, 1):
        words = line.split()
        if not words or words[0] == _HEADER[0]:
            continue
        try:
            if len(words) < _LEAST_COLUMNS:
                raise ValueError
            serial = words.pop(_HEADER.index("kilobot_sn"))
            x, y, cell, stamp, *data = map(int, words)
            yield Report(x, y, cell, stamp, serial, bytes(data[:DATA_BYTES]))
        except ValueError:
            what = f"'{line}' is no report; allowed: {' '.join(_HEADER)}"
            raise InputError(f"{source}:{number}: {what}") from None
