"""Files that are there whole or not at all."""

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def draft_of(target: Path, *, sync: bool = True) -> Iterator[Path]:
    """A file to write that then becomes `target`, whole and on the disk; or `target` stays.

    Without `sync` that holds for a kill, not for a machine that goes down: it costs no time.
    """
    draft = draft_name(target)
    try:
        yield draft
        if sync:
            with draft.open("rb") as file:
                os.fsync(file.fileno())
        draft.replace(target)
    finally:
        draft.unlink(missing_ok=True)


@contextlib.contextmanager
def folder_draft_of(target: Path) -> Iterator[Path]:
    """A folder to fill that then becomes `target`, unless another process was faster with it."""
    target.parent.mkdir(parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(dir=target.parent, prefix=f".{target.name}-"))
    try:
        yield draft
        with contextlib.suppress(OSError):
            draft.replace(target)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def draft_name(target: Path) -> Path:
    """The name of the draft; a machine that goes down while it is written leaves it."""
    return target.with_name(f".{target.name}.new")
