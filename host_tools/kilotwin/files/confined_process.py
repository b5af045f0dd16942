"""Confines a process in which robots' programs run (emulator/base/confinement.h)."""

import sys
from collections.abc import Iterable
from pathlib import Path

from kilotwin import _emulator
from kilotwin.files import resources

# Memory that programs may take beside what the process has when it is confined.
_MEMORY_BYTES = 640 * 1024 * 1024
_MEMORY_PER_ROBOT_BYTES = 20 * 1024
_FILE_BYTES = 1 << 30


def confine_process(
    robots: int,
    *,
    readable: Iterable[Path] = (),
    writable: Iterable[Path] = (),
    most_written: int = 0,
    sockets: bool = False,
) -> list[str]:
    """Leaves this process these files and folders, Python, for what it imports late, and our own
    package. No file of its grows beyond `most_written` bytes and a gigabyte. Returns the layers
    that the kernel lacks.
    """
    python = (Path(entry) for entry in sys.path if entry)
    return _emulator.confine(
        readable=[str(path) for path in (*readable, *python, *resources.build_folders())],
        writable=[str(path.absolute()) for path in writable],
        memory_bytes=_MEMORY_BYTES + _MEMORY_PER_ROBOT_BYTES * robots,
        file_bytes=_FILE_BYTES + most_written,
        sockets=sockets,
    )
