"""Work in a fork of this process, which has all libraries loaded: that takes milliseconds, where a
process of its own takes half a second. The fork can bring down nothing but itself."""

import contextlib
import os
import resource
import signal
from collections.abc import Callable
from typing import NoReturn

from kilotwin import _emulator

# More than any answer takes.
_MOST = (1 << 30) + (1 << 16)


def in_fork(work: Callable[[], bytes]) -> tuple[bytes, int]:
    """The bytes that `work` returned in the fork, and the fork's wait status.

    A program may have written the bytes: check them. This process must have no other threads.
    """
    receive, send = os.pipe()
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        _be_fork(work, send, parent)
    os.close(send)
    with os.fdopen(receive, "rb") as pipe:
        said = pipe.read(_MOST)
    _, status = os.waitpid(child, 0)
    return said, status


def ended_by(status: int) -> signal.Signals | None:
    """The signal that ended a fork, if one did."""
    return signal.Signals(os.WTERMSIG(status)) if os.WIFSIGNALED(status) else None


def _be_fork(work: Callable[[], bytes], send: int, parent: int) -> NoReturn:
    """Writes what the work returns, and ends without cleaning up."""
    code = 1
    with contextlib.suppress(BaseException):
        _emulator.end_with_parent(parent)
        # The executor's pipes are not for programs.
        os.closerange(3, send)
        os.closerange(send + 1, resource.getrlimit(resource.RLIMIT_NOFILE)[0])
        left = memoryview(work())
        while left:
            left = left[os.write(send, left) :]
        code = 0
    os._exit(code)
