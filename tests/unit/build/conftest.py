"""A cache of built programs for each test."""

import contextlib
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

OBJECTS = "*-objects"


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """As on the first day, with the compiler and the flags that Kilotwin takes unasked."""
    for name in ("KILOTWIN_CC", "KILOTWIN_CFLAGS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("KILOTWIN_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def cache(empty_cache: Path, guest_cache: Path) -> Iterator[Path]:
    """As on the second day: no program is built, but what all are linked with, by any test."""
    for kept in guest_cache.glob(OBJECTS):
        shutil.copytree(kept, empty_cache / kept.name)
    yield empty_cache
    for made in empty_cache.glob(OBJECTS):
        with contextlib.suppress(OSError):  # it is there
            made.rename(guest_cache / made.name)
