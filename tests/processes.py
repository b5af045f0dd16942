"""Processes as /proc has them (proc(5)), any of which may end at any moment."""

import contextlib
from pathlib import Path


def children(pid: int) -> list[int]:
    """Its children's numbers; none once it is gone."""
    found: list[int] = []
    with contextlib.suppress(FileNotFoundError):
        for listing in Path(f"/proc/{pid}/task").glob("*/children"):
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):
                found += map(int, listing.read_text().split())
    return found


def stat(pid: int) -> list[str]:
    """Fields of its `stat` from the state on; none once it is gone."""
    with contextlib.suppress(FileNotFoundError, ProcessLookupError):
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return []


def alive(pid: int) -> bool:
    """Whether it has not ended yet; one that ended and was not waited for counts as gone."""
    return stat(pid)[:1] not in ([], ["Z"])
