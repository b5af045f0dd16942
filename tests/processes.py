"""Processes as /proc has them (proc(5)), any of which may end at any moment."""

import contextlib
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any


@contextlib.contextmanager
def serving(
    command: Sequence[object], before: str = "", **options: Any
) -> Iterator[tuple["subprocess.Popen[str]", str]]:
    """A command that has begun, and the address that it says first; it is ended with the block.

    `before`: how the line with the address begins; then it is one of stderr. `options`: those of
    Popen.
    """
    with subprocess.Popen(
        list(map(str, command)),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE if before else None,
        text=True,
        **options,
    ) as process:
        try:
            said = process.stderr if before else process.stdout
            assert said is not None
            address = next((line.strip() for line in said if line.startswith(before)), "")
            assert address, f"{' '.join(process.args)}: ended before it had an address"  # type: ignore[arg-type]
            yield process, address.removeprefix(before)
        finally:
            process.terminate()


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
