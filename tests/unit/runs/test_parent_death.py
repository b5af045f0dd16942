"""A worker ends when its parent does, whatever it is doing."""

import os
import signal
import subprocess
import sys
import time

import pytest
from tests.processes import alive

pytestmark = pytest.mark.waits

CHILD = """
import os, signal, sys, time
from kilotwin import _emulator
_emulator.end_with_parent(int(sys.argv[1]), float(sys.argv[2]))
{ignores}
print(os.getpid(), flush=True)
time.sleep(1000)
"""
PARENT = """
import subprocess, sys, os, time
child = subprocess.Popen([sys.executable, "-c", sys.argv[1], str(os.getpid()), sys.argv[2]])
time.sleep(1000)
"""


def lives_on_s(grace_s: float, ignores: str = "") -> float:
    """How long a child, which sleeps for 1000 s, lives on when its parent is killed."""
    script = CHILD.format(ignores=ignores)
    words = [sys.executable, "-c", PARENT, script, str(grace_s)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        began = time.monotonic()
        parent.kill()
        parent.wait()
        try:
            while alive(child):
                assert time.monotonic() < began + 600, "it lives on"
                time.sleep(0.01)
        finally:
            if alive(child):
                os.kill(child, signal.SIGKILL)
    return time.monotonic() - began


def test_a_worker_is_killed_with_its_parent() -> None:
    lives_on_s(0)


@pytest.mark.parametrize(
    "ignores", ["", "signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())"]
)
def test_a_worker_with_time_to_close_is_killed_after_it(ignores: str) -> None:
    assert lives_on_s(1, ignores) > 0.9


def test_a_worker_whose_parent_has_gone_already_ends_at_once() -> None:
    script = CHILD.format(ignores="")
    done = subprocess.run(
        [sys.executable, "-c", script, "1", "0"], capture_output=True, check=False, timeout=600
    )
    assert (done.returncode, done.stdout) == (1, b"")


CONFINED = """
import os, sys
from pathlib import Path
from kilotwin import _emulator
from kilotwin.files.confined_process import confine_process
_emulator.end_with_parent(os.getppid(), 1000)
guardian = Path(f"/proc/self/task/{os.getpid()}/children").read_text()
confine_process(1)
print(guardian, flush=True)
"""


def test_a_confined_worker_that_ends_leaves_no_guardian_to_its_parent() -> None:
    done = subprocess.run([sys.executable, "-c", CONFINED], capture_output=True, check=True)
    guardian = int(done.stdout)
    began = time.monotonic()
    while alive(guardian):
        assert time.monotonic() < began + 600, "it lives on"
        time.sleep(0.01)
