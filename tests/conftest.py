"""Shared by all tests. Programs are not held against their ATmega328P, but where that is tested."""

import os
import signal
from pathlib import Path

import pytest

os.environ["KILOTWIN_NO_TWIN"] = "1"

# Commands inherit what is ignored, not what is handled: under nohup they heed a test's signals, and
# tests still outlive their terminal.
for number in (signal.SIGHUP, signal.SIGINT):
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, lambda *_: None)


@pytest.fixture(scope="session")
def guest_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compiled programs of this session: a test never sees what an older build left.

    One for all processes of pytest-xdist, each of which has its own folder of temporary files
    beside it, so that a program is compiled once.
    """
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    cache = folder / "guests"
    cache.mkdir(exist_ok=True)
    return cache
