"""The pool hands trials out by series, has each answered once, and survives its workers."""

import contextlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from kilotwin.errors import RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.studies.pool.pool import Pool
from kilotwin.studies.pool.series import run_series
from kilotwin.studies.pool.task import Answer, Done, Failed, Task
from kilotwin.studies.sweep.measure import Rows

ROOT = Path(__file__).resolve().parents[3]
TEXT = f"""\
duration_s = 60
arena.diameter_m = 1.0
[swarm]
profile = "kilobot"
cpu = "native"
program = "{ROOT}/firmware/blank.c"
size = 20
"""


@pytest.fixture
def task(tmp_path: Path) -> Task[bytes]:
    (tmp_path / "my.toml").write_text(TEXT)
    return Task(Experiment.load(tmp_path / "my.toml"), Rows(), ("a",))


def seeded(task: Task[bytes], seed: int, **how: Any) -> Task[bytes]:
    keys = task.experiment.keys.model_copy(update={"seed": seed})
    return replace(task, experiment=replace(task.experiment, keys=keys), **how)


class Fake(Executor):
    """A place of two workers, which answer at once by `answer`; series that it was given."""

    name = "a test"

    def __init__(self, answer: Callable[[Task[bytes]], Answer[bytes]]) -> None:
        self._answer = answer
        self.series: list[list[int]] = []
        self.opened = 0

    @contextlib.contextmanager
    def open(self) -> Iterator[Executor]:
        self.opened += 1
        yield self

    def workers(self) -> int:
        return 2

    def submit(self, work: Callable[..., Any], what: Any) -> Future[Any]:  # type: ignore[override]
        future: Future[Any] = Future()
        try:
            if work is run_series:
                self.series.append([one.seed for one in what])
                future.set_result([self._answer(one) for one in what])
            else:
                future.set_result(work(what))
        except BrokenExecutor as error:
            future.set_exception(error)
        return future


def done(task: Task[bytes]) -> Answer[bytes]:
    return Done(bytes([task.seed]), 0.0, "", "")


def answered(pool: Pool, tasks: Sequence[Task[bytes]], again: Any = None) -> dict[int, Any]:
    answers = list(pool.answers(tasks, again))
    assert Counter(index for index, _ in answers) == Counter(range(len(tasks)))
    return dict(answers)


def test_each_trial_is_answered_once_by_series_of_the_same_programs(task: Task[bytes]) -> None:
    place = Fake(done)
    tasks = [seeded(task, seed, programs=("ab"[seed % 2],)) for seed in range(100)]
    answers = answered(Pool(place), tasks)
    assert [answers[seed].value for seed in range(100)] == [bytes([seed]) for seed in range(100)]
    assert all(len({seed % 2 for seed in series}) == 1 for series in place.series)
    assert all(series == sorted(series) for series in place.series)
    assert len(place.series) <= 10


def test_long_trials_go_one_by_one(task: Task[bytes]) -> None:
    keys = task.experiment.keys.model_copy(update={"duration_s": 1e6})
    long = replace(task, experiment=replace(task.experiment, keys=keys))
    place = Fake(done)
    answered(Pool(place), [seeded(long, seed) for seed in range(5)])
    assert place.series == [[0], [1], [2], [3], [4]]


def test_a_trial_that_failed_has_a_second_try_unless_it_took_too_long(task: Task[bytes]) -> None:
    def fails(one: Task[bytes]) -> Answer[bytes]:
        return Failed("why", timed_out=one.seed == 2) if one.seed else done(one)

    again: list[int] = []

    def second(index: int) -> Callable[[], Answer[bytes]]:
        again.append(index)
        return lambda: Failed("why again")

    answers = answered(Pool(Fake(fails)), [seeded(task, seed) for seed in range(4)], second)
    assert again == [1, 3]
    assert [getattr(answers[index], "reason", "") for index in range(4)] == [
        *("", "why again", "why", "why again")
    ]


def test_a_worker_that_dies_costs_nothing_but_its_time(task: Task[bytes]) -> None:
    died: list[int] = []

    def dies_once(one: Task[bytes]) -> Answer[bytes]:
        if one.seed == 7 and not died:
            died.append(1)
            raise BrokenExecutor
        return done(one)

    place = Fake(dies_once)
    pool = Pool(place)
    answers = answered(pool, [seeded(task, seed) for seed in range(20)])
    assert all(isinstance(answer, Done) for answer in answers.values())
    assert place.opened == 2
    assert [7] in place.series


def test_workers_that_die_again_and_again_are_an_error(task: Task[bytes]) -> None:
    def dies(_: Task[bytes]) -> Answer[bytes]:
        raise BrokenExecutor

    with pytest.raises(RunError, match="workers die again and again"):
        answered(Pool(Fake(dies)), [task])


def test_workers_stay_between_batches_until_the_pool_is_closed(task: Task[bytes]) -> None:
    place = Fake(done)
    with Pool(place) as pool:
        for _ in range(3):
            answered(pool, [task])
    assert place.opened == 1
    answered(pool, [task])
    assert place.opened == 2
