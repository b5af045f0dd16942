"""Where the record batches of an Arrow IPC stream begin, and how many rows each has.

Read from the messages' heads alone, so that a stream of a gigabyte is open at once, and one that
grows is read on from where it ended. Source: Arrow columnar format, "IPC streaming format" and
Message.fbs; the heads are flatbuffers.
"""

import bisect
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import pyarrow as pa

_CONTINUES = 0xFFFFFFFF
_RECORD_BATCH = 3
# A run's server and its worker share two cores.
_ONE_THREAD = pa.ipc.IpcReadOptions(use_threads=False)


@dataclass(frozen=True)
class Batch:
    """A record batch: bytes [begin, end) of the file, rows [row, row + rows) of the table."""

    begin: int
    end: int
    row: int
    rows: int


class StreamIndex:
    """The whole batches of a stream, as far as it is written."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._read_to = 0
        self._head: bytes | None = None  # the schema and the dictionaries
        self.names: list[str] = []
        """The table's columns; none before its first batch."""
        self.batches: list[Batch] = []

    @property
    def rows(self) -> int:
        """Rows in whole batches."""
        return self.batches[-1].row + self.batches[-1].rows if self.batches else 0

    def refresh(self) -> None:
        """Takes in what was written since. OSError if the file cannot be read."""
        with self._file.open("rb") as stream:
            size = stream.seek(0, 2)
            while True:
                stream.seek(self._read_to)
                start = stream.read(8)
                if len(start) < 8:
                    return
                mark, length = struct.unpack("<Ii", start)
                if mark != _CONTINUES or length <= 0:
                    return  # the stream's end
                head = stream.read(length)
                kind, rows, body = _message(head) if len(head) == length else (0, 0, size)
                end = self._read_to + 8 + length + body
                if end > size:
                    return  # under way, or torn
                if kind == _RECORD_BATCH:
                    if self._head is None:
                        self._take_head(stream)
                    self.batches.append(Batch(self._read_to, end, self.rows, rows))
                self._read_to = end

    def _take_head(self, stream: BinaryIO) -> None:
        """All before the first batch."""
        stream.seek(0)
        self._head = stream.read(self._read_to)
        schema = pa.ipc.open_stream(pa.py_buffer(self._head), options=_ONE_THREAD).schema
        self.names = list(schema.names)

    def at_row(self, row: int) -> int:
        """The number of the batch that has a row."""
        return bisect.bisect_right(self.batches, row, key=lambda batch: batch.row) - 1

    def read(self, batch: Batch, columns: list[str]) -> pa.RecordBatch:
        """Some of its columns; KeyError if the stream has no such."""
        assert self._head is not None
        if not set(columns) <= set(self.names):
            raise KeyError(f"one of {', '.join(columns)}")
        with self._file.open("rb") as stream:
            stream.seek(batch.begin)
            data = self._head + stream.read(batch.end - batch.begin)
        places = sorted(self.names.index(name) for name in columns)
        options = pa.ipc.IpcReadOptions(use_threads=False, included_fields=places)
        return pa.ipc.open_stream(pa.py_buffer(data), options=options).read_next_batch()


def _message(head: bytes) -> tuple[int, int, int]:
    """A Message's kind, its rows if it is a record batch, and the bytes of its body."""
    (table,) = struct.unpack_from("<I", head)
    kind_at, header_at, body_at = (_field(head, table, number) for number in (1, 2, 3))
    kind = head[kind_at] if kind_at else 0
    body = struct.unpack_from("<q", head, body_at)[0] if body_at else 0
    rows = 0
    if kind == _RECORD_BATCH and header_at:
        header = header_at + struct.unpack_from("<I", head, header_at)[0]
        rows_at = _field(head, header, 0)
        rows = struct.unpack_from("<q", head, rows_at)[0] if rows_at else 0
    return kind, rows, body


def _field(data: bytes, table: int, number: int) -> int:
    """Where a flatbuffer table's field is; 0 if it is left out."""
    vtable = table - struct.unpack_from("<i", data, table)[0]
    (size,) = struct.unpack_from("<H", data, vtable)
    at = 4 + 2 * number
    if at >= size:
        return 0
    (offset,) = struct.unpack_from("<H", data, vtable + at)
    return table + offset if offset else 0
