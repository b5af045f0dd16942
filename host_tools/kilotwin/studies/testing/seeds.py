"""A test over seeds: each in a fork of pytest's process, as many at a time as there are cores.

A test is a user's Python, which makes worlds of its own and has pytest's fixtures: so it is no
trial of the pool, which runs experiments alone, but forks as that does.
"""

import contextlib
import functools
import os
import pickle
import shutil
import signal
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from kilotwin.session.fork import Fork, Say
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
    running: list[tuple[int, Fork]] = []
    try:
        while waiting or running:
            while waiting and len(running) < cores:
                for stream in (sys.stdout, sys.stderr):
                    stream.flush()  # the fork has no second copy to print
                test = functools.partial(_test, item, arguments, waiting[0], timeout_s)
                running.append((waiting.pop(0), Fork(test)))
            yield _end(*running.pop(0))
    finally:
        for _, fork in running:
            fork.end(at_once=True)


def _test(
    item: pytest.Function, arguments: dict[str, object], seed: int, timeout_s: float, say: Say
) -> None:
    """In the fork: the test itself, what it said, and no more of pytest."""
    ran = _Ran(seed)
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
    say(pickle.dumps(ran))


def _end(seed: int, fork: Fork) -> _Ran:
    said = fork.said()
    ended = fork.end()
    if ended.signal is not None:
        name = ended.signal.name
        why = "it took too long" if name == "SIGALRM" else f"its process was ended by {name}"
        return _Ran(seed, why)
    with contextlib.suppress(Exception):
        ran = pickle.loads(said or b"")
        if isinstance(ran, _Ran):
            return ran
    return _Ran(seed, "its process ended without a result")
