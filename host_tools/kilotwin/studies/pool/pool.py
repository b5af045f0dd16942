"""Hands trials to the workers of an executor, and takes back what comes of them, in any order.

Short trials go out by series of half a second or so, in which they share a worker's fork; long ones
one by one. A worker that dies costs what it ran, which is run again.
"""

import contextlib
import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass
from typing import Any, Self, TypeVar

from kilotwin.errors import RunError
from kilotwin.session.estimate import cpu_s_of
from kilotwin.studies.pool.places import Place
from kilotwin.studies.pool.series import run_series
from kilotwin.studies.pool.task import Answer, Failed, Task

_SERIES_S = 0.5
"""About how much CPU time a series takes, and so what a kill costs at most."""
_SERIES_MOST = 100
_SERIES_LEAST_S = 0.025
"""A shorter series is not worth a fork of its own, however few trials are left."""
_BROKEN_MOST = 20
_WAITING_PER_WORKER = 3
_WORKERS_UNKNOWN = 64

T = TypeVar("T")
Again = Callable[[int], "Callable[[], Answer[T]]"]
"""The second try of a failed trial by its index: a function that a worker can be sent."""


class Pool:
    """Workers of a place. Left as a context they end, with what they run."""

    def __init__(self, place: Place) -> None:
        self._place = place
        self._workers = place.workers()
        self._open: contextlib.ExitStack | None = None
        self._executor: Executor | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends its workers; the next trials have new ones."""
        if self._open is not None:
            self._open.close()
        self._open = self._executor = None

    def answers(
        self, tasks: Sequence[Task[T]], again: "Again[T] | None" = None
    ) -> Iterator[tuple[int, Answer[T]]]:
        """The answer to each task with its index, as they come.

        A trial that failed is tried `again` if that is given, but one that took too long. RunError
        if workers die again and again.
        """
        yield from _Batch(self, tasks, again).answers()

    @property
    def most_at_once(self) -> int:
        """Series that are handed out at a time."""
        return _WAITING_PER_WORKER * (self._workers or _WORKERS_UNKNOWN)

    def share(self, left: int) -> int:
        """The length of a series at most while so many trials are left, so that no worker has none
        while another has many."""
        workers = self._workers or _WORKERS_UNKNOWN
        return max(1, min(_SERIES_MOST, math.ceil(left / (2 * workers))))

    def submit(self, work: Callable[..., Any], *of: Any) -> "Future[Any]":
        """Hands out a piece of work. BrokenExecutor if a worker has died."""
        if self._executor is None:
            self._open = contextlib.ExitStack()
            self._executor = self._open.enter_context(self._place.open())
        return self._executor.submit(work, *of)


class _Batch:
    """Trials that are being run: those that wait, by their programs, and those handed out."""

    def __init__(self, pool: Pool, tasks: Sequence[Task[Any]], again: "Again[Any] | None") -> None:
        self._pool = pool
        self._tasks = tasks
        self._again = again
        self._waiting: dict[tuple[str, ...], deque[int]] = {}
        for index, task in enumerate(tasks):
            self._waiting.setdefault(tuple(task.programs), deque()).append(index)
        self._left = len(tasks)
        self._ready: deque[_Try] = deque()
        self._running: dict[Future[list[Answer[Any]]], _Try] = {}
        self._lost: set[int] = set()

    def answers(self) -> Iterator[tuple[int, Answer[Any]]]:
        for _ in range(_BROKEN_MOST):
            try:
                yield from self._drain()
                return
            except BrokenExecutor:
                self._pool.close()
                for lost in self._running.values():
                    self._ready.extend(self._next_try(index, lost) for index in lost.indices)
                self._running = {}
        raise RunError("workers die again and again; see to memory and disk, then type it again")

    def _drain(self) -> Iterator[tuple[int, Answer[Any]]]:
        while self._left or self._ready or self._running:
            while (self._left or self._ready) and len(self._running) < self._pool.most_at_once:
                self._hand_out()
            done, _ = wait(self._running, return_when=FIRST_COMPLETED)
            for future in done:
                answers = _answers_of(future, self._running[future])
                one = self._running.pop(future)
                for index, answer in zip(one.indices, answers, strict=True):
                    failed = isinstance(answer, Failed) and not answer.timed_out
                    if failed and not one.is_last and self._again is not None:
                        self._ready.append(_Try((index,), is_last=True))
                    else:
                        yield index, answer

    def _hand_out(self) -> None:
        if not self._ready:
            self._ready.append(_Try(tuple(self._series())))
        one = self._ready[0]
        if one.is_last and self._again is not None:
            future = self._pool.submit(_alone, self._again(one.indices[0]))
        else:
            future = self._pool.submit(run_series, [self._tasks[index] for index in one.indices])
        self._running[future] = self._ready.popleft()

    def _next_try(self, index: int, lost: "_Try") -> "_Try":
        """The next try of a trial whose worker died: alone, and the last once it did so twice."""
        is_last = lost.is_last or index in self._lost
        self._lost.add(index)
        return _Try((index,), is_last)

    def _series(self) -> list[int]:
        """The next trials: the first that waits, and those with its programs that follow it."""
        first = min(self._waiting, key=lambda programs: self._waiting[programs][0])
        queue = self._waiting[first]
        most, takes_s = self._pool.share(self._left), 0.0
        series: list[int] = []
        while queue and (len(series) < most or takes_s < _SERIES_LEAST_S) and takes_s < _SERIES_S:
            series.append(queue.popleft())
            takes_s += cpu_s_of(self._tasks[series[-1]].experiment)
        self._left -= len(series)
        if not queue:
            del self._waiting[first]
        return series


@dataclass(frozen=True)
class _Try:
    """Trials for one worker; `is_last`: the second try of one that failed."""

    indices: tuple[int, ...]
    is_last: bool = False


def _alone(run: Callable[[], Answer[Any]]) -> list[Answer[Any]]:
    """In a worker: the second try of a trial."""
    return [run()]


def _answers_of(future: "Future[list[Answer[Any]]]", one: _Try) -> list[Answer[Any]]:
    """Those of trials; a worker that Dask lost for good counts as their failure."""
    try:
        return future.result()
    except BrokenExecutor:
        raise
    except Exception as error:
        return [Failed(f"{type(error).__name__}: {error}") for _ in one.indices]
