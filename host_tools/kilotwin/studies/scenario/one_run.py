"""One run of a scenario, in a fork of an executor's process, confined as a sweep's trial is."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kilotwin.errors import KilotwinError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.medium import MEDIA
from kilotwin.files import confinement
from kilotwin.programs.cache import Notify
from kilotwin.programs.coverage.marks import Marks, marks_of_all, understood
from kilotwin.programs.group import build_all, settled, symbols_of
from kilotwin.session.black_box import BlackBox
from kilotwin.session.confined_worker import confine_trial, unconfined_because
from kilotwin.session.fork import run_in_fork
from kilotwin.session.job import Job
from kilotwin.session.trial import Trial
from kilotwin.studies.scenario.looks import Failure, Look, Looks
from kilotwin.studies.sweep.measure import GRACE_S, clock_of


@dataclass(frozen=True)
class Task:
    """One run for a process of an executor. `guests`, `covered`, `symbols`: as Job has
    them."""

    experiment: Experiment
    guests: list[str]
    module_guest: str
    timeout_s: float
    trusted: bool
    covered: bool = False
    symbols: tuple[Path | None, ...] = ()

    @property
    def seed(self) -> int:
        """The run's."""
        return self.experiment.keys.seed


@dataclass(frozen=True)
class Ran:
    """The outcome of a run.

    `looks`: one for each [[expect]], None of those without a condition. `rates`: messages a second
    of each robot, or their mean alone. `trouble`: why it did not come to its end, "" if it did.
    """

    seed: int
    looks: tuple[Look | None, ...] = ()
    crashes: tuple[Failure, ...] = ()
    busy_waits: tuple[Failure, ...] = ()
    undefined: tuple[Failure, ...] = ()
    rates: tuple[float, ...] = ()
    trouble: str = ""
    timed_out: bool = False
    result_hash: str = ""
    uids: Sequence[int] = ()
    """The uid of each robot, by its index."""
    marks: Sequence[Marks] = ()
    """The marks of each group's program, where that is asked for."""


def tasks_of(
    experiment: Experiment,
    runs: int,
    timeout_s: float,
    notify: Notify,
    *,
    covered: bool = False,
    sanitized: bool = False,
) -> list[Task]:
    """Builds the programs; a task for each seed, from the experiment's on."""
    for note in experiment.notes():
        notify(f"{experiment.origin.source}: {note}")
    experiment = settled(experiment, notify)
    built, modules = build_all(experiment, notify, covered=covered, sanitized=sanitized)
    guests = [str(guest.file) for guest in built]
    module_guest = "" if modules is None else str(modules.file)
    symbols = symbols_of(built, modules)
    trusted = confinement.mode() == "off"
    first = experiment.keys.seed
    return [
        Task(
            with_seed(experiment, seed), guests, module_guest, timeout_s, trusted, covered, symbols
        )
        for seed in range(first, first + runs)
    ]


def with_seed(experiment: Experiment, seed: int) -> Experiment:
    """The same with another seed."""
    return replace(experiment, keys=experiment.keys.model_copy(update={"seed": seed}))


def run_once(task: Task) -> Ran:
    """Runs it in a fork; whatever brings that down is the run's trouble."""
    try:
        ended = run_in_fork(
            lambda box: json.dumps(_in_fork(task, box)).encode(),
            task.experiment,
            task.timeout_s + GRACE_S,
        )
    except KilotwinError as error:
        return Ran(task.seed, trouble=str(error))
    if ended.late:
        return Ran(task.seed, trouble=_too_long(task, None), timed_out=True)
    if number := ended.signal:
        return Ran(task.seed, trouble=f"its process was ended by {number.name}")
    try:
        return _understood(task, json.loads(ended.said))
    except (ValueError, KeyError, TypeError, RecursionError):
        return Ran(task.seed, trouble="its process ended without a result")


def _in_fork(task: Task, box: BlackBox) -> dict[str, Any]:
    experiment, module = task.experiment, task.module_guest
    job = Job(experiment, task.guests, Path(), {}, str(box.path), module, symbols=task.symbols)
    confined = not (task.trusted or unconfined_because(experiment) or experiment.functions)
    is_over = clock_of(task.timeout_s)
    try:
        trial = Trial(
            job,
            lambda _: None,
            lambda: Looks(experiment),
            (lambda: confine_trial(job)) if confined else lambda: None,
        )
        in_time = trial.run(is_over)
    except KilotwinError as error:
        return {"trouble": str(error), "timed_out": False}
    summary = trial.summary(interrupted=not in_time)
    trial.close()
    if not in_time:
        return {"trouble": _too_long(task, summary["simulated_s"]), "timed_out": True}
    if spoiled := summary["metrics_failed"]:
        name, why = next(iter(spoiled.items()))
        return {"trouble": f"metric {name}: {why}", "timed_out": False}
    return {
        "looks": [
            None if look is None else [look.passed, look.seen] for look in trial.writer.looks()
        ],
        "crashes": [vars(one) for one in (*trial.writer.crashes, *_modules(summary))],
        "busy_waits": [vars(one) for one in trial.writer.busy_waits],
        "undefined": [vars(one) for one in trial.writer.undefined],
        "rates": _rates(task, trial, summary),
        "result_hash": summary["result_hash"],
        "marks": marks_of_all(job.all_guests) if task.covered else [],
    }


def _rates(task: Task, trial: Trial[Looks], summary: dict[str, Any]) -> list[float]:
    """Messages a second: of each robot, or their mean where the medium does not count by robot."""
    for_s = max(summary["simulated_s"], 1e-9)
    if not MEDIA[task.experiment.keys.medium.kind].counts_by_robot:
        return [summary["stats"]["frames_sent"] / summary["robots"] / for_s]
    return [float(rate) for rate in trial.frames()[:, 0] / for_s]


def _modules(summary: dict[str, Any]) -> list[Failure]:
    failed = summary.get("grid", {}).get("modules_failed", [])
    return [
        Failure(
            f"module {one['module'][0]}-{one['module'][1]}",
            str(one["what"]),
            one.get("file", ""),
            one.get("line", 0),
        )
        for one in failed
    ]


def _too_long(task: Task, simulated_s: float | None) -> str:
    so_far = (
        ""
        if simulated_s is None
        else (f", when {simulated_s:,.1f} of {task.experiment.keys.duration_s:,g} s were simulated")
    )
    return f"time-out: stopped after {task.timeout_s:g} s{so_far}"


def _understood(task: Task, told: dict[str, Any]) -> Ran:
    """The fork's answer, which a program may have written; ValueError and such of what is not."""
    if "trouble" in told:
        return Ran(task.seed, trouble=str(told["trouble"]), timed_out=told["timed_out"] is True)
    looks = [
        None if look is None else Look(look[0] is True, str(look[1])) for look in told["looks"]
    ]
    if [look is None for look in looks] != [
        expect.condition is None for expect in task.experiment.keys.expect
    ]:
        raise ValueError("other expectations")
    return Ran(
        task.seed,
        tuple(looks),
        tuple(map(Failure.understood, told["crashes"])),
        tuple(map(Failure.understood, told["busy_waits"])),
        tuple(map(Failure.understood, told["undefined"])),
        tuple(map(float, told["rates"])),
        result_hash=str(told["result_hash"]),
        uids=task.experiment.uids,
        marks=understood(told["marks"]),
    )
