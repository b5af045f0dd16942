"""Trials one after the other, where an executor puts them: the one way in which a trial is run.

They run in a fork of the executor's worker, which has all libraries, finds their programs built
once, and is confined once, as a run's worker is (docs/security.md). A fork takes tens of
milliseconds until it has touched its memory, and a short trial takes five: so trials of the same
programs share one. Whatever brings a fork down costs the trial that it was at; the others go on in
the next. After a trial in which a program failed the fork ends too, since that program may have
left something behind.
"""

import functools
import hashlib
import itertools
import json
import math
import platform
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy.ma  # noqa: F401 (numpy loads it at its first use, which would be in each fork)

from kilotwin import _emulator
from kilotwin.errors import KilotwinError
from kilotwin.files import confinement
from kilotwin.session.black_box import BlackBox, Watch
from kilotwin.session.confined_worker import confine_trials, load_libraries, unconfined_because
from kilotwin.session.fork import Ended, Fork, Say
from kilotwin.session.job import Job
from kilotwin.session.trial import Trial
from kilotwin.studies.pool.built import Built, built_for
from kilotwin.studies.pool.helper import run_by_helper
from kilotwin.studies.pool.task import Answer, Done, Failed, Ran, Task

# After its time a trial ends within a second, unless the engine hangs.
GRACE_S = 10.0

T = TypeVar("T")


@functools.cache
def engine_sha256() -> str:
    """Which engine this is: results of different ones do not belong into one data set."""
    assert _emulator.__file__ is not None
    return hashlib.sha256(Path(_emulator.__file__).read_bytes()).hexdigest()


def run_series(tasks: Sequence[Task[T]]) -> list[Answer[T]]:
    """Runs trials; what programs or the engine refuse, or bring down, comes back as Failed.

    They are confined but where programs are trusted, and where the user's own Python takes part. A
    process with threads (a Dask worker) has a helper that forks.
    """
    if threading.active_count() > 1:
        return run_by_helper(tasks)
    answers: list[Answer[T]] = []
    while len(answers) < len(tasks):
        answers += _in_one_fork(tasks[len(answers) :])
    return answers


def is_confined(task: Task[Any]) -> bool:
    """Whether its programs are held off from what is the user's."""
    experiment = task.experiment
    free = experiment.functions and confinement.mode() != "require"
    return not (task.trusted or unconfined_because(experiment) or free)


def _in_one_fork(tasks: Sequence[Task[T]]) -> list[Answer[T]]:
    """Answers to the first of these tasks, one at least."""
    try:
        built = built_for(tasks[0])
    except KilotwinError as error:
        return [Failed(str(error))]
    alike = list(itertools.takewhile(lambda task: _alike(task, tasks[0]), tasks))
    load_libraries(tasks[0].experiment)
    answers: list[Answer[T]] = []
    try:
        with BlackBox.made() as box, Fork(lambda say: _work(alike, built, box, say)) as fork:
            for task in alike:
                watch = Watch(box)
                limit_s = None if task.timeout_s is None else task.timeout_s + GRACE_S
                said = fork.said(watch, limit_s)
                if said is None:
                    answers.append(_ended(task, fork.end(), watch, box))
                    break
                answer, goes_on = _told(task, said)
                answers.append(answer)
                if not goes_on:
                    break
    except KilotwinError as error:  # there is no black box
        answers.append(Failed(str(error)))
    return answers


def _alike(task: Task[Any], first: Task[Any]) -> bool:
    """Whether they may share a process: a program can harm trials of its own programs only. A
    user's Python is loaded for each trial, which a confined process cannot do again."""

    def kind(one: Task[Any]) -> tuple[Any, ...]:
        return tuple(one.programs), one.variant, one.sanitized, is_confined(one)

    own_python = first.experiment.environment is not None or bool(first.experiment.functions)
    return task is first or (kind(task) == kind(first) and not (own_python and is_confined(first)))


def _work(tasks: Sequence[Task[Any]], built: Built, box: BlackBox, say: Say) -> None:
    """In the fork: runs trials, and says of each a head, and its outcome."""
    say.close_others()
    jobs = [built.job(task.experiment, box.path, variant=task.variant) for task in tasks]
    confine = _once((lambda: confine_trials(jobs)) if is_confined(tasks[0]) else lambda: None)
    for task, job in zip(tasks, jobs, strict=True):
        said, goes_on = b"", False
        try:
            head, said, goes_on = _run(task, job, confine)
        except KilotwinError as error:
            head = {"failed": str(error), "timed_out": False}
        except Exception as error:
            head = {"failed": f"{type(error).__name__}: {error}", "timed_out": False}
        say(json.dumps({**head, "goes_on": goes_on}).encode() + b"\n" + said)
        if not goes_on:
            return


def _run(
    task: Task[Any], job: Job, confine: Callable[[], None]
) -> tuple[dict[str, Any], bytes, bool]:
    outcome = task.outcome
    end_s = math.inf if task.timeout_s is None else time.monotonic() + task.timeout_s
    trial = Trial(job, lambda _: None, lambda: outcome.writer(task.experiment), confine)
    in_time = outcome.run(trial, lambda: time.monotonic() >= end_s)
    summary = trial.summary(interrupted=not in_time)
    trial.close()
    if not in_time:
        return {"failed": task.stopped_when(summary), "timed_out": True}, b"", False
    said = outcome.answer(Ran(job, trial, summary))
    failed = summary["robots_failed"] or summary["undefined"]
    failed = failed or summary.get("grid", {}).get("modules_failed")
    return {"cpu_s": summary["cpu_s"]}, said, not failed


def _once(act: Callable[[], None]) -> Callable[[], None]:
    """The act, done at its first call and not again."""
    return functools.cache(act)


def _told(task: Task[T], said: bytes) -> tuple[Answer[T], bool]:
    """The fork's answer of a trial, which a program may have written; and whether it goes on."""
    head, _, outcome = said.partition(b"\n")
    try:
        told = json.loads(head)
        goes_on = told["goes_on"] is True
        if "failed" in told:
            return Failed(str(told["failed"]), told["timed_out"] is True), goes_on
        value = task.outcome.understood(task, outcome)
        return Done(value, float(told["cpu_s"]), engine_sha256(), platform.node()), goes_on
    except (ValueError, KeyError, TypeError, RecursionError):
        return Failed("its process handed back what is no result"), False


def _ended(task: Task[Any], ended: Ended, watch: Watch, box: BlackBox) -> Failed:
    """Why a fork ended, or was ended, during a trial."""
    if ended.stuck:
        return Failed(watch.what(task.experiment))
    if ended.greedy:
        return Failed(box.out_of_memory(task.experiment))
    if ended.late:
        return Failed(f"{task.stopped_after()}, in which it did not come back", timed_out=True)
    if number := ended.signal:
        return Failed(f"its process was ended by {number.name}")
    return Failed("its process ended without a result")
