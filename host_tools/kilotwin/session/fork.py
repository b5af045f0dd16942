"""Work in a fork of this process, which has all libraries loaded: that takes milliseconds, where a
process of its own takes half a second. The fork can bring down nothing but itself."""

import contextlib
import os
import resource
import select
import signal
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn, Self

from kilotwin import _emulator
from kilotwin.files import memory_group
from kilotwin.session.black_box import LOOK_S, Watch

# More than any answer takes.
_MOST = (1 << 30) + (1 << 16)
_BLOCK = 1 << 20
_END_S = 10.0
_LENGTH = struct.Struct("=Q")


class Say:
    """In the fork: hands the parent one thing after the other."""

    def __init__(self, send: int) -> None:
        self._send = send

    def __call__(self, answer: bytes) -> None:
        left = memoryview(_LENGTH.pack(len(answer)) + answer)
        while left:
            left = left[os.write(self._send, left) :]

    def close_others(self) -> None:
        """Closes all files of the fork but 0, 1, 2 and its own: others are not for programs."""
        os.closerange(3, self._send)
        os.closerange(self._send + 1, resource.getrlimit(resource.RLIMIT_NOFILE)[0])


@dataclass(frozen=True)
class Ended:
    """The outcome of a fork: the last bytes that its work said, which a program may have written,
    and its wait status. This process ended it if it was `late` or `stuck`, the kernel if it was
    `greedy`: it wanted more memory than there is for it."""

    said: bytes
    status: int
    late: bool = False
    stuck: bool = False
    greedy: bool = False

    @property
    def signal(self) -> signal.Signals | None:
        """The signal that ended it, if one did."""
        status = self.status
        return signal.Signals(os.WTERMSIG(status)) if os.WIFSIGNALED(status) else None


class Fork:
    """A fork that does some work and says one thing after the other meanwhile.

    This process must have no other threads. Left as a context, the fork has ended.
    """

    def __init__(self, work: Callable[[Say], None]) -> None:
        self._receive, send = os.pipe()
        parent = os.getpid()
        self._child = os.fork()
        if self._child == 0:
            _be_fork(work, send, parent)
        os.close(send)
        self._read = bytearray()
        self._late = self._stuck = False
        self._ended: Ended | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end(at_once=True)

    def said(self, watch: Watch | None = None, limit_s: float | None = None) -> bytes | None:
        """The next thing that it says; None if it ends before, or would have to be ended: after
        `limit_s` from now, or since `watch` finds it stuck. Then end() says more."""
        looks_at = time.monotonic() + LOOK_S
        ends_at = None if limit_s is None else time.monotonic() + limit_s
        while (whole := self._whole()) is None:
            if select.select([self._receive], [], [], max(0.0, looks_at - time.monotonic()))[0]:
                block = os.read(self._receive, _BLOCK)
                if not block:
                    return None
                self._read += block
                if self._expected() > _MOST:
                    return None
            if time.monotonic() >= looks_at:
                looks_at = time.monotonic() + LOOK_S
                self._stuck = watch is not None and watch.is_stuck()
                self._late = ends_at is not None and time.monotonic() >= ends_at
                if self._stuck or self._late:
                    return None
        return whole

    def end(self, *, at_once: bool = False) -> Ended:
        """Waits until it has ended: it is done, or is ended now, as is one that does not end when
        it has said all."""
        if self._ended is None:
            os.close(self._receive)
            if at_once or self._late or self._stuck or not _ends(self._child):
                os.kill(self._child, signal.SIGKILL)
            _, status = os.waitpid(self._child, 0)
            greedy = memory_group.remove(self._child)
            left = bytes(self._read)
            self._ended = Ended(left, status, self._late, self._stuck, greedy)
        return self._ended

    @property
    def file(self) -> int:
        """Readable once it has said more, or has ended."""
        return self._receive

    def _expected(self) -> int:
        """How long what it is saying is; 0 while that is unknown."""
        if len(self._read) < _LENGTH.size:
            return 0
        return int(_LENGTH.unpack_from(self._read)[0])

    def _whole(self) -> bytes | None:
        end = _LENGTH.size + self._expected()
        if len(self._read) < end:
            return None
        whole = bytes(self._read[_LENGTH.size : end])
        del self._read[:end]
        return whole


def _ends(child: int) -> bool:
    """Whether it ends now that it has said all; a program may have closed its pipe."""
    handle = os.pidfd_open(child)
    try:
        return bool(select.select([handle], [], [], _END_S)[0])
    finally:
        os.close(handle)


def _be_fork(work: Callable[[Say], None], send: int, parent: int) -> NoReturn:
    """Does the work, and ends without cleaning up."""
    code = 1
    with contextlib.suppress(BaseException):
        _emulator.end_with_parent(parent)
        work(Say(send))
        code = 0
    os._exit(code)
