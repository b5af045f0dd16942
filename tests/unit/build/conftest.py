"""A cache of built programs for each test."""

from pathlib import Path

import pytest


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty one, and the compiler and the flags that Kilotwin takes unasked."""
    for name in ("KILOTWIN_CC", "KILOTWIN_CFLAGS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("KILOTWIN_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"
