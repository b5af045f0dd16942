"""One run of a scenario: what of a trial its expectations are judged by."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from kilotwin.errors import RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.medium import MEDIA
from kilotwin.programs.cache import Notify
from kilotwin.programs.coverage.marks import Marks, marks_of_all, understood
from kilotwin.programs.group import settled
from kilotwin.programs.variant import Variant
from kilotwin.studies.pool.built import Builder
from kilotwin.studies.pool.series import run_series
from kilotwin.studies.pool.task import Answer, Failed, Outcome, Task
from kilotwin.studies.pool.task import Ran as RanTrial
from kilotwin.studies.scenario.looks import Failure, Look, Looks


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
    mistakes: tuple[Failure, ...] = ()
    rates: tuple[float, ...] = ()
    trouble: str = ""
    timed_out: bool = False
    result_hash: str = ""
    uids: Sequence[int] = ()
    """The uid of each robot, by its index."""
    marks: Sequence[Marks] = ()
    """The marks of each group's program, where that is asked for."""
    led_changes: Sequence[tuple[int, int]] = ()
    """LED bytes before and after, of each pair that a robot showed in samples one after the
    other, where that is asked for ..."""
    starts: Sequence[tuple[float, float, float]] = ()
    """... and the pose of each robot in the first of them."""
    numbers: Sequence[tuple[int, int]] = ()
    """Sizes of variables at the end, each with its group, where that is asked for."""


class Seen(Outcome[Looks, Ran]):
    """Looks at a run whose programs may fail."""

    def writer(self, experiment: Experiment) -> Looks:
        """Looks at what is expected."""
        return Looks(experiment)

    def answer(self, ran: RanTrial[Looks]) -> bytes:
        """As JSON; RunError where a metric's function failed."""
        trial, summary, experiment = ran.trial, ran.summary, ran.job.experiment
        for name, why in summary["metrics_failed"].items():
            raise RunError(f"metric {name}: {why}")
        looks = trial.writer
        told = {
            "looks": [None if look is None else [look.passed, look.seen] for look in looks.looks()],
            "crashes": [vars(one) for one in (*looks.crashes, *_modules(summary))],
            "busy_waits": [vars(one) for one in looks.busy_waits],
            "undefined": [vars(one) for one in looks.undefined],
            "mistakes": [vars(one) for one in looks.mistakes],
            "rates": _rates(experiment, ran),
            "result_hash": summary["result_hash"],
            "marks": marks_of_all(ran.job.all_guests) if ran.job.covered else [],
            "led_changes": sorted(looks.led_changes),
            "starts": looks.starts,
            "numbers": self.numbers(ran),
        }
        return json.dumps(told).encode()

    def understood(self, task: Task[Ran], said: bytes) -> Ran:
        """ValueError and such of what is none."""
        told, experiment = json.loads(said), task.experiment
        looks = [
            None if look is None else Look(look[0] is True, str(look[1])) for look in told["looks"]
        ]
        if [look is None for look in looks] != [
            expect.condition is None for expect in experiment.keys.expect
        ]:
            raise ValueError("other expectations")
        return Ran(
            experiment.keys.seed,
            tuple(looks),
            tuple(map(Failure.understood, told["crashes"])),
            tuple(map(Failure.understood, told["busy_waits"])),
            tuple(map(Failure.understood, told["undefined"])),
            tuple(map(Failure.understood, told["mistakes"])),
            tuple(map(float, told["rates"])),
            result_hash=str(told["result_hash"]),
            uids=experiment.uids,
            marks=understood(told["marks"]),
            led_changes=tuple((int(before), int(after)) for before, after in told["led_changes"]),
            starts=tuple((float(x), float(y), float(turn)) for x, y, turn in told["starts"]),
            numbers=tuple((int(group), int(one)) for group, one in told["numbers"]),
        )

    def numbers(self, ran: RanTrial[Looks]) -> list[tuple[int, int]]:
        """Ran.numbers; none."""
        return []


def tasks_of(
    experiment: Experiment,
    runs: int,
    timeout_s: float,
    notify: Notify,
    *,
    variant: Variant = "plain",
    sanitized: bool = False,
) -> list[Task[Ran]]:
    """Builds the programs; a task for each seed, from the experiment's on."""
    for note in experiment.notes():
        notify(f"{experiment.origin.source}: {note}")
    experiment = settled(experiment, notify)
    built = Builder(notify, variant=variant, sanitized=sanitized).built(experiment)
    first = experiment.keys.seed
    return [
        Task(
            with_seed(experiment, seed),
            Seen(),
            built.keys,
            timeout_s,
            trusted=Task.trusts(),
            variant=variant,
            sanitized=sanitized,
        )
        for seed in range(first, first + runs)
    ]


def with_seed(experiment: Experiment, seed: int) -> Experiment:
    """The same with another seed."""
    return replace(experiment, keys=experiment.keys.model_copy(update={"seed": seed}))


def run_once(task: Task[Ran]) -> Ran:
    """Runs it; whatever brings it down is the run's trouble."""
    (answer,) = run_series([task])
    return ran_of(task, answer)


def ran_of(task: Task[Ran], answer: Answer[Ran]) -> Ran:
    """The run that a trial was; one that failed is in trouble."""
    if not isinstance(answer, Failed):
        return answer.value
    why = f"time-out: {answer.reason}" if answer.timed_out else answer.reason
    return Ran(task.seed, trouble=why, timed_out=answer.timed_out)


def _rates(experiment: Experiment, ran: RanTrial[Looks]) -> list[float]:
    """Messages a second: of each robot, or their mean where the medium does not count by robot."""
    trial, summary = ran.trial, ran.summary
    for_s = max(summary["simulated_s"], 1e-9)
    if not MEDIA[experiment.keys.medium.kind].counts_by_robot:
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
