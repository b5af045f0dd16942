"""Confines a process in which robots' programs run (emulator/base/confinement.h)."""

import site
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import kilotwin
from kilotwin import _emulator
from kilotwin.files import memory_group, resources

# Memory that programs may take beside what the process has when it is confined.
_MEMORY_BYTES = 640 * 1024 * 1024
_MEMORY_PER_ROBOT_BYTES = 20 * 1024
FILE_BYTES = 1 << 30
"""Size of a file that it may write, beside what the run needs."""


def confine_process(
    robots: int,
    *,
    readable: Iterable[Path] = (),
    writable: Iterable[Path] = (),
    most_written: int = 0,
    sockets: bool = False,
    loads_later: bool = False,
    forks_bytes: int = 0,
) -> list[str]:
    """Leaves this process these files and folders, Python, for what it imports late, and our own
    package. No file of its grows beyond `most_written` bytes and a gigabyte. `loads_later`: it
    may map code until _emulator.end_loading(). `forks_bytes`: it may fork, and all forks together
    have so much memory more. Returns the layers that the kernel lacks.
    """
    memory_bytes = _MEMORY_BYTES + _MEMORY_PER_ROBOT_BYTES * robots
    return _emulator.confine(
        readable=[str(path) for path in (*readable, *_python(), *resources.build_folders())],
        writable=[str(path.absolute()) for path in writable],
        memory_bytes=memory_bytes,
        file_bytes=FILE_BYTES + most_written,
        memory_group=memory_group.make(memory_bytes + forks_bytes),
        sockets=sockets,
        loads_later=loads_later,
        forks=forks_bytes > 0,
    )


def _python() -> Iterator[Path]:
    """Where Python imports from, without folders of the user's: `python -m` and pytest add the
    present one, and those of tests."""
    ours = Path(kilotwin.__file__).resolve().parents[1]
    installed = [Path(prefix) for prefix in (sys.prefix, sys.base_prefix, site.getuserbase())]
    for entry in filter(None, sys.path):
        path = Path(entry).resolve()
        if path == ours or any(path.is_relative_to(prefix) for prefix in installed):
            yield path
