"""The file of finished trials, one after the other as they come: each with its key and a checksum.

A trial is appended in one write, so that a kill cuts the last one at most. What is damaged, by a
disk or a hand, is found by its checksum, and what follows it by the mark with which a part begins.
"""

import hashlib
import mmap
import os
import struct
import time
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path

from kilotwin.files.drafts import draft_of

_MARK = b"\x00\xffKilotwin part\n"
_HEAD = struct.Struct(f"={len(_MARK)}s32sQ32s")  # mark, key, length, SHA-256 of key and stream
_SYNC_S = 1.0
"""A machine that goes down loses the trials of about so long."""


class Parts:
    """Parts by their keys of 32 characters. One process at a time may write."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._synced_s = 0.0
        self.damaged: list[int] = []
        """Where what is no whole part begins, but for a last one that is cut."""
        self._end = 0

    @cached_property
    def _places(self) -> dict[str, tuple[int, int]]:
        """Begin and end of each part's stream."""
        places = {}
        if self._file.exists() and self._file.stat().st_size:
            with (
                self._file.open("rb") as file,
                mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content,
            ):
                for key, begin, end in self._whole(content):
                    places[key] = begin, end
        return places

    def _whole(self, content: mmap.mmap) -> Iterator[tuple[str, int, int]]:
        at = 0
        while at < len(content):
            if place := _part_at(content, at):
                yield place
                at = self._end = place[2]
                continue
            found = content.find(_MARK, at + 1)
            if found >= 0 or not _MARK.startswith(content[at : at + len(_MARK)]):
                self.damaged.append(at)
            at = found if found >= 0 else len(content)

    def __contains__(self, key: str) -> bool:
        """Whether that one is there, undamaged."""
        return key in self._places

    def __len__(self) -> int:
        """How many there are."""
        return len(self._places)

    def read(self, key: str) -> bytes | None:
        """The stream of one; None if it is not there, or was damaged since. OSError."""
        if key not in self._places:
            return None
        begin, end = self._places[key]
        with self._file.open("rb") as file:
            part = os.pread(file.fileno(), end - begin + _HEAD.size, begin - _HEAD.size)
        stream = part[_HEAD.size :]
        return stream if part == _part(key, stream) else None

    def mend(self) -> None:
        """Leaves what is whole and nothing else, so that parts can be added. OSError."""
        places = self._places
        if self.damaged:
            with draft_of(self._file) as draft, draft.open("wb") as file:
                for key in places:
                    file.write(_part(key, self.read(key) or b""))
            del self._places
            self.damaged = []
        elif self._file.exists():
            os.truncate(self._file, self._end)  # one that is cut

    def add(self, key: str, stream: bytes) -> None:
        """Appends a part. OSError leaves at most one that is cut."""
        part, places = _part(key, stream), self._places
        with self._file.open("ab", buffering=0) as file:
            begin = file.tell()
            # Known before it is there: an interrupt meanwhile loses none, and read() looks closely.
            places[key] = begin + _HEAD.size, begin + len(part)
            try:
                left = memoryview(part)
                while left:
                    left = left[file.write(left) :]
                if time.monotonic() >= self._synced_s + _SYNC_S:
                    os.fsync(file.fileno())
                    self._synced_s = time.monotonic()
            except OSError:
                file.truncate(begin)
                del places[key]
                raise
        self._end = begin + len(part)


def _part(key: str, stream: bytes) -> bytes:
    return _HEAD.pack(_MARK, key.encode(), len(stream), _digest(key.encode(), stream)) + stream


def _part_at(content: mmap.mmap, at: int) -> tuple[str, int, int] | None:
    """The key, the begin and the end of a whole part's stream."""
    if at + _HEAD.size > len(content):
        return None
    mark, key, length, digest = _HEAD.unpack_from(content, at)
    begin, end = at + _HEAD.size, at + _HEAD.size + length
    if mark != _MARK or end > len(content) or _digest(key, content[begin:end]) != digest:
        return None
    return key.decode(), begin, end


def _digest(key: bytes, stream: bytes) -> bytes:
    return hashlib.sha256(key + stream).digest()
