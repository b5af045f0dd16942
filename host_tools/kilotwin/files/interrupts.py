"""Ctrl-C, a polite kill and a terminal that goes away, for what ends with its data kept."""

import contextlib
import math
import os
import signal
import stat
import time
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

Handler = Callable[[int, FrameType | None], Any]

SAME_S = 1.0
"""`timeout`, make and CI signal a process and then its group: a signal that comes so soon after
another is the same one."""


def once(handler: Handler, *, heard: bool = False) -> Handler:
    """`handler`, which is not called again for SAME_S once it was. `heard`: it just was."""
    heard_s = time.monotonic() if heard else -math.inf

    def heed(number: int, frame: FrameType | None) -> None:
        nonlocal heard_s
        now_s = time.monotonic()
        if now_s - heard_s >= SAME_S:
            heard_s = now_s
            handler(number, frame)

    return heed


@contextlib.contextmanager
def heeding_interrupts(handler: Handler) -> Iterator[None]:
    """Within, these signals call `handler`, also where a shell has them ignored (`&`); but a
    terminal that goes away does not under `nohup`. Two within SAME_S are one.

    Outside the main thread nothing changes: signals are not ours there.
    """

    handler = once(handler)

    def hung_up(number: int, frame: FrameType | None) -> None:
        _leave_terminal()
        handler(number, frame)

    heeded: dict[int, Handler] = {signal.SIGINT: handler, signal.SIGTERM: handler}
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        heeded[signal.SIGHUP] = hung_up
    before = {}
    for number, heed in heeded.items():
        with contextlib.suppress(ValueError):
            before[number] = signal.signal(number, heed)
    try:
        yield
    finally:
        for number, former in before.items():
            signal.signal(number, former)


def _leave_terminal() -> None:
    """Output to a terminal, which is gone and would be an error, goes nowhere from here on."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for output in (1, 2):
        with contextlib.suppress(OSError):
            if stat.S_ISCHR(os.fstat(output).st_mode):
                os.dup2(nowhere, output)
    os.close(nowhere)
