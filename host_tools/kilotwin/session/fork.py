"""Work in a fork of this process, which has all libraries loaded: that takes milliseconds, where a
process of its own takes half a second. The fork can bring down nothing but itself."""

import contextlib
import os
import resource
import select
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn

from kilotwin import _emulator
from kilotwin.errors import RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.files import memory_group
from kilotwin.session.black_box import LOOK_S, BlackBox, Watch
from kilotwin.session.confined_worker import load_libraries

# More than any answer takes.
_MOST = (1 << 30) + (1 << 16)
_BLOCK = 1 << 20
_END_S = 10.0


@dataclass(frozen=True)
class Ended:
    """The outcome of a fork: the bytes that its work returned, which a program may have written,
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


def run_in_fork(
    work: Callable[[BlackBox], bytes], experiment: Experiment, limit_s: float | None
) -> Ended:
    """Does a run of the experiment in a fork, whose engine writes the black box that `work` gets.

    RunError, which names the robot, if it had to be ended since nothing went on in it, or took too
    much memory.
    """
    load_libraries(experiment)  # once for all runs
    with BlackBox.made() as box:
        watch = Watch(box)
        ended = in_fork(lambda: work(box), watch, limit_s)
        if ended.stuck:
            raise RunError(watch.what(experiment))
        if ended.greedy:
            raise RunError(box.out_of_memory(experiment))
    return ended


def in_fork(work: Callable[[], bytes], watch: Watch, limit_s: float | None = None) -> Ended:
    """Does the work in a fork, and ends that after `limit_s`, or when `watch` finds it stuck.

    This process must have no other threads.
    """
    receive, send = os.pipe()
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        _be_fork(work, send, parent)
    os.close(send)
    late = stuck = False
    try:
        said = bytearray()
        looks_at = time.monotonic() + LOOK_S
        ends_at = None if limit_s is None else time.monotonic() + limit_s
        while len(said) < _MOST and not (late or stuck):
            if select.select([receive], [], [], max(0.0, looks_at - time.monotonic()))[0]:
                block = os.read(receive, _BLOCK)
                if not block:
                    break
                said += block
            if time.monotonic() >= looks_at:
                looks_at = time.monotonic() + LOOK_S
                stuck = watch.is_stuck()
                late = ends_at is not None and time.monotonic() >= ends_at
    finally:
        os.close(receive)
        if late or stuck or not _ends(child):
            os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        greedy = memory_group.remove(child)
    return Ended(bytes(said), status, late, stuck, greedy)


def _ends(child: int) -> bool:
    """Whether it ends now that it has said all; a program may have closed its pipe."""
    handle = os.pidfd_open(child)
    try:
        return bool(select.select([handle], [], [], _END_S)[0])
    finally:
        os.close(handle)


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
