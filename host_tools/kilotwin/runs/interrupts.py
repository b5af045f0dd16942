"""Ctrl-C and a polite kill, for what ends with its data kept."""

import contextlib
import signal
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

Handler = Callable[[int, FrameType | None], Any]


@contextlib.contextmanager
def heeding_interrupts(handler: Handler) -> Iterator[None]:
    """Within, both signals call `handler`, also where a shell has them ignored (`&`).

    Outside the main thread nothing changes: signals are not ours there.
    """
    before = {}
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(ValueError):
            before[number] = signal.signal(number, handler)
    try:
        yield
    finally:
        for number, former in before.items():
            signal.signal(number, former)
