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


@pytest.fixture(scope="session", autouse=True)
def guest_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compiled programs of this session: a test never sees what an older build left.

    In $TESTS_GUESTS, which tests/run_all.py sets; else one for all processes of pytest-xdist, each
    of which has its own folder of temporary files beside it. So a program is compiled once.
    """
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    cache = Path(os.environ.get("TESTS_GUESTS", folder / "guests"))
    cache.mkdir(exist_ok=True)
    os.environ["KILOTWIN_CACHE"] = str(cache)
    return cache
