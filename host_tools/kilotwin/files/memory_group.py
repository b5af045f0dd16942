"""A cgroup for each worker, where the user may make one (cgroup v2, in a delegated subtree).

It bounds what rlimits do not count: the kernel's memory for a process, and files in memory. The
worker makes it and joins it; the process that waits for the worker asks what came of it.
"""

import contextlib
import os
from pathlib import Path

ROOT = Path("/sys/fs/cgroup")
OWN = Path("/proc/self/cgroup")
# Beside what rlimits leave: they are to strike first, for malloc() then says so.
_MORE_BYTES = 256 << 20


def make(most_bytes: int) -> str:
    """Makes the group of this process: the file by which it joins; "" where there can be none."""
    for parent in _parents():
        group = parent / _name(os.getpid())
        with contextlib.suppress(OSError):
            if "memory" not in (parent / "cgroup.subtree_control").read_text().split():
                continue
            group.mkdir()
            with contextlib.suppress(OSError):  # a kernel may not count what is swapped
                (group / "memory.swap.max").write_text("0")
            (group / "memory.max").write_text(str(most_bytes + _MORE_BYTES))
            return str(group / "cgroup.procs")
    return ""


def remove(process: int) -> bool:
    """Removes the group of a process that has ended; whether that took more memory than it has."""
    ran_out = False
    for parent in _parents():
        group = parent / _name(process)
        with contextlib.suppress(OSError, ValueError):
            lines = (group / "memory.events").read_text().splitlines()
            events = dict(line.split() for line in lines)
            ran_out = int(events.get("oom_kill", 0)) > 0
        with contextlib.suppress(OSError):
            group.rmdir()
    return ran_out


def _parents() -> list[Path]:
    """Groups in which one may be made: that of this process, if it is a root, and the one above,
    since no other may have both processes and groups."""
    with contextlib.suppress(OSError):
        for line in OWN.read_text().splitlines():
            if line.startswith("0::/"):
                own = ROOT / line.removeprefix("0::/")
                return [own] if own == ROOT else [own, own.parent]
    return []


def _name(process: int) -> str:
    return f"kilotwin-{process}"
