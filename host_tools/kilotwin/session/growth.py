"""Bound on what robots' programs leave in a run folder, where their worker may make files."""

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path

# So long, in times of what a look took, none is taken again: 1 % at most goes into looking.
_REST = 100
_BLOCK_BYTES = 512  # of st_blocks


class Growth:
    """Counts files and folders, and what they take on the disk. The kernel bounds each file alone
    (emulator/base/confinement.h)."""

    def __init__(self, folder: Path, most_files: int, most_bytes: int) -> None:
        self._folder = folder
        self._most_files, self._most_bytes = most_files, most_bytes
        self._next_look_s = 0.0

    def too_much(self, process: int | None = None) -> str:
        """The excess as a clause; "" while there is none. To be called while `process` runs, as
        often as one likes: files without a name that it has open count too; and at the end."""
        began_s = time.monotonic()
        if process is not None and began_s < self._next_look_s:
            return ""
        files = taken = 0
        try:
            for found in (*_nameless(process), *_below(self._folder, self._most_files)):
                files += 1
                taken += found.st_blocks * _BLOCK_BYTES
        except OSError as error:  # a name that is too long, a folder that hides what it has
            return f"programs made a folder that cannot be read ({error.strerror})"
        self._next_look_s = began_s + _REST * (time.monotonic() - began_s)
        if files > self._most_files:
            return f"programs made files in its folder: there are more than {self._most_files:,}"
        if taken > self._most_bytes:
            size = f"{self._most_bytes / 1e9:.0f} GB"
            return f"programs filled its folder: it takes more than {size}"
        return ""


def _below(folder: Path, most: int) -> Iterator[os.stat_result]:
    """All that lies in the folder, up to one more than `most`."""
    waiting, left = [str(folder)], most + 1
    while waiting and left:
        try:
            entries = os.scandir(waiting.pop())
        except FileNotFoundError:
            continue
        with entries:
            for entry in entries:
                try:
                    yield entry.stat(follow_symlinks=False)
                except FileNotFoundError:
                    continue
                if entry.is_dir(follow_symlinks=False):
                    waiting.append(entry.path)
                left -= 1
                if not left:
                    return


def _nameless(process: int | None) -> Iterator[os.stat_result]:
    """Files of the process without a name; none once it has ended."""
    if process is None:
        return
    try:
        numbers = list(Path(f"/proc/{process}/fd").iterdir())
    except (FileNotFoundError, PermissionError):
        return
    for number in numbers:
        with contextlib.suppress(OSError):
            found = number.stat()
            if found.st_nlink == 0:
                yield found
