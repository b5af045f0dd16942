"""A test over seeds: each in a fork of pytest's process, as many at a time as there are cores."""

import contextlib
import os
import pickle
import shutil
import signal
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import pytest

from kilotwin.studies.compare.plain_intervals import share_interval
from kilotwin.studies.testing.plugin import KEPT

_LISTED = 10


@dataclass
class _Ran:
    """One seed's test. `said`: its traceback, or how its process ended; "" if it passed."""

    seed: int
    said: str = ""
    skipped: str = ""
    kept: list[Path] = field(default_factory=list)


def run(
    item: pytest.Function,
    number: int = 20,
    *,
    first: int = 1,
    at_least: float = 1.0,
    timeout_s: float = 600,
) -> None:
    """Runs the test with each seed; fails with the first traceback if too few have passed."""
    __tracebackhide__ = True
    used: Any = item.funcargs.get("kilotwin")
    if used is None:
        pytest.fail("a test over seeds needs the fixture `world` or `kilotwin`", pytrace=False)
    names = item._fixtureinfo.argnames
    arguments = {name: item.funcargs[name] for name in names}
    ran = list(_all(item, arguments, range(first, first + number), timeout_s))
    if skipped := [one.skipped for one in ran if one.skipped]:
        pytest.skip(skipped[0])
    failed = [one for one in ran if one.said]
    share = share_interval(number - len(failed), number)
    if share.high >= at_least if at_least < 1 else not failed:
        _forget(failed)
        return
    _forget(failed[1:])
    item.stash[KEPT] = used.lines_on(failed[0].kept)
    seeds = ", ".join(str(one.seed) for one in failed[:_LISTED])
    more = " ..." if len(failed) > _LISTED else ""
    pytest.fail(
        f"{number - len(failed)} of {number} seeds passed, a share of {share}, expected "
        f"{at_least:g} at least; failed: seeds {seeds}{more}\n\nseed {failed[0].seed}:\n"
        f"{failed[0].said}",
        pytrace=False,
    )


def _forget(ran: list[_Ran]) -> None:
    """Removes what they kept."""
    for one in ran:
        for folder in one.kept:
            shutil.rmtree(folder, ignore_errors=True)


def _all(
    item: pytest.Function, arguments: dict[str, object], seeds: range, timeout_s: float
) -> Iterator[_Ran]:
    """Runs each seed in a fork, as many at once as there are cores; yields results in order.

    This process has no thread of ours when it forks.
    """
    cores = len(os.sched_getaffinity(0))
    waiting = list(seeds)
    running: list[tuple[int, int, int]] = []
    while waiting or running:
        while waiting and len(running) < cores:
            running.append(_begin(item, arguments, waiting.pop(0), timeout_s))
        yield _end(*running.pop(0))


def _begin(
    item: pytest.Function, arguments: dict[str, object], seed: int, timeout_s: float
) -> tuple[int, int, int]:
    receive, send = os.pipe()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    child = os.fork()
    if child == 0:
        os.close(receive)
        _be_test(item, arguments, seed, send, timeout_s)
    os.close(send)
    return seed, child, receive


def _be_test(
    item: pytest.Function, arguments: dict[str, object], seed: int, send: int, timeout_s: float
) -> NoReturn:
    """In the child: the test itself, what it said, and no more of pytest."""
    ran = _Ran(seed)
    code = 1
    with contextlib.suppress(BaseException):
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, timeout_s)
        used: Any = item.funcargs["kilotwin"]
        used.seed = seed
        try:
            item.obj(**arguments)
        except pytest.skip.Exception as skipped:
            ran.skipped = str(skipped) or "skipped"
        except BaseException:
            error = pytest.ExceptionInfo.from_current()
            error.traceback = error.traceback.cut(path=item.path) or error.traceback
            ran.said = str(error.getrepr(style="short")) or "it failed"
            ran.kept = used.keep(item.name)
        left = memoryview(pickle.dumps(ran))
        while left:
            left = left[os.write(send, left) :]
        code = 0
    os._exit(code)


def _end(seed: int, child: int, receive: int) -> _Ran:
    with os.fdopen(receive, "rb") as pipe:
        said = pipe.read()
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        name = signal.Signals(os.WTERMSIG(status)).name
        why = "it took too long" if name == "SIGALRM" else f"its process was ended by {name}"
        return _Ran(seed, why)
    with contextlib.suppress(Exception):
        ran = pickle.loads(said)
        if isinstance(ran, _Ran):
            return ran
    return _Ran(seed, "its process ended without a result")
