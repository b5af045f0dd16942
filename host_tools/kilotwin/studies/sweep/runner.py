"""Runs what of a plan is not there yet, and keeps what comes back."""

import contextlib
import math
import shutil
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

from kilotwin.errors import EXIT_INTERRUPTED, KilotwinError, RunError
from kilotwin.experiment.experiment import Tier
from kilotwin.experiment.programs import Program
from kilotwin.files import confinement
from kilotwin.files.build_id import Target
from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.programs.cache import Notify
from kilotwin.programs.group import build_group, settled
from kilotwin.programs.native.guest import Guest
from kilotwin.programs.port.twin import Mode, Native, Twins, native_kilobots
from kilotwin.runs.folder import EXPERIMENT, slug, utc_now
from kilotwin.runs.reader import Run
from kilotwin.session.estimate import cpu_s_of
from kilotwin.studies.sweep.confined_trial import measure_confined
from kilotwin.studies.sweep.data_set import DataSet, failure_line, trial_key
from kilotwin.studies.sweep.executors import Place
from kilotwin.studies.sweep.measure import Failed, Measured, Task, engine_sha256, measure_apart
from kilotwin.studies.sweep.plan import Plan, Trial, shown
from kilotwin.units import counted, duration_text

# From here on a sweep waits for the faster code of its programs before it begins.
_LONG_CPU_S = 60.0
_BYTES_PER_SAMPLE = 8
_BYTES_PER_TRIAL = 4096
_BROKEN_MOST = 20
_WAITING_PER_WORKER = 4
_WORKERS_UNKNOWN = 64

Answer = Measured | Failed


class Display(Protocol):
    """Shows a sweep while it goes on."""

    def note(self, text: str) -> None:
        """One line."""

    def start(self, trials: int, done: int) -> None:
        """So many trials, so many of them there already."""

    def progress(self, done: int, failed: int, left_s: float, last: str) -> None:
        """So far has it come."""

    def stop(self) -> None:
        """It is over."""


@dataclass(frozen=True)
class Estimate:
    """Cost of a sweep: `cpu_s` and `disk_bytes` of the trials that are not there yet."""

    trials: int
    done: int
    cpu_s: float
    disk_bytes: float
    measured: bool

    def text(self, place: Place) -> str:
        """For people, before the sweep begins."""
        source = "by the trials that are there" if self.measured else "a guess"
        there = f", {self.done} of them there already" if self.done else ""
        workers = place.workers()
        took = duration_text(self.cpu_s / (workers or 1)) + (
            " of one core" if workers is None else ""
        )
        return (
            f"{counted(self.trials, 'trial')}{there}; about {took} on {place.name} ({source}), "
            f"{self.disk_bytes / 1e6:.0f} MB"
        )


def _settled(plan: Plan, notify: Notify) -> Plan:
    trials = [replace(trial, experiment=settled(trial.experiment, notify)) for trial in plan.trials]
    return replace(plan, trials=trials)


@dataclass
class Sweep:
    """A plan and its data set.

    `keys` are the trials' in the order of the plan, `there` those of the finished ones; `native`
    are the programs of Kilobots that run natively.
    """

    plan: Plan
    data: DataSet
    keys: Sequence[str]
    there: set[str] = field(default_factory=set)
    native: Sequence[Native] = ()
    failures: dict[str, Failed] = field(default_factory=dict)
    interrupted: bool = False
    damaged: int = 0

    @staticmethod
    def prepare(plan: Plan, folder: Path, notify: Notify) -> "Sweep":
        """Builds the programs, looks what is in the folder, and writes nothing into it."""
        data = DataSet.at(folder, engine_sha256())
        guests: dict[tuple[Program, Tier, Target | None], Guest] = {}
        keys = []
        native: list[Native] = []
        at_once = sum(cpu_s_of(trial.experiment) for trial in plan.trials) < _LONG_CPU_S
        notes = {note: None for trial in plan.trials for note in trial.experiment.notes()}
        plan = _settled(plan, lambda note: notes.update({note: None}))
        for note in notes:
            notify(note)
        for trial in plan.trials:
            parts = list(trial.experiment.groups)
            if trial.experiment.modules is not None:
                parts.append(trial.experiment.modules)
            groups = [
                (
                    (group.program, group.tier, group.boot_loader),
                    group,
                )
                for group in parts
            ]
            for what, group in groups:
                if what not in guests:
                    guests[what] = build_group(group, notify, at_once=at_once)
            built = [guests[what] for what, _ in groups]
            native += native_kilobots(trial.experiment, built)
            programs = [guest.key for guest in built]
            if trial.experiment.environment is not None:
                programs.append(trial.experiment.environment.sha256())
            programs += [named.sha256() for named in trial.experiment.functions.values()]
            if trial.experiment.wire is not None:
                programs.append(trial.experiment.wire.sha256())
            keys.append(trial_key(trial, programs))
        there = {key for key in keys if data.has(key)}
        damaged = [key for key in keys if key not in there and data.part(key).exists()]
        if damaged:
            notify(
                f"{folder}: damaged parts: {len(damaged)}, the first {data.part(damaged[0]).name}; "
                "these trials are run again"
            )
        return Sweep(plan, data, keys, there, native)

    def missing(self) -> list[tuple[Trial, str]]:
        """Trials without a result, in the order to run them in."""
        ordered = ((trial, self.keys[trial.index]) for trial in self.plan.in_running_order())
        return [(trial, key) for trial, key in ordered if key not in self.there]

    def estimate(self) -> Estimate:
        """The estimate for the trials that are left."""
        missing = self.missing()
        measured = self.data.seconds_per_robot_second()
        guessed = sum(cpu_s_of(trial.experiment) for trial, _ in missing)
        return Estimate(
            len(self.plan.trials),
            len(self.plan.trials) - len(missing),
            measured * sum(_robot_s(trial) for trial, _ in missing) if measured else guessed,
            # Once in its part, once in the table.
            2 * sum(_bytes(trial) for trial, _ in missing),
            measured is not None,
        )

    def run(self, place: Place, display: Display, twin: Mode = "off") -> None:
        """Runs what is missing; a failed trial once more.

        Ctrl-C, or a polite kill, loses what is being run only.
        """
        missing = self.missing()
        twins = Twins(self.native if missing else (), twin, display.note)
        self.data.begin(self.plan, self.keys)
        total = len(self.plan.trials)
        display.start(total, total - len(missing))
        progress = _Progress(display, missing, total)
        first = [
            _Try(
                trial,
                Task(
                    key,
                    trial.experiment,
                    self.data.failed_folder(key).absolute(),
                    self.plan.keys.trial_timeout_s,
                    confinement.mode() == "off",
                ),
                measure_apart if confinement.mode() == "require" else measure_confined,
            )
            for trial, key in missing
        ]
        try:
            with heeding_interrupts(signal.default_int_handler):
                for attempt, answer in _answers(first, place):
                    self._take(attempt, answer, progress)
        except KeyboardInterrupt:
            self.interrupted = True
        finally:
            display.stop()
        if not self.interrupted:
            twins.verdicts()

    def finish(self) -> int:
        """Writes the tables of all that is there; returns the number of trials in them."""
        self._clear_failed()
        finished = self.data.assemble(self.plan, self.keys)
        self.damaged = len(self.there) - finished
        return finished

    def _clear_failed(self) -> None:
        """Removes run folders of trials that have succeeded since, be it as a mended program."""
        done: set[str] | None = None
        for file in self.data.failed_folder("*").parent.glob(f"*/{EXPERIMENT}"):
            if file.parent.name in self.keys:
                succeeded = file.parent.name in self.there
            else:
                done = done or {
                    trial.experiment.identity()
                    for trial, key in zip(self.plan.trials, self.keys, strict=True)
                    if key in self.there
                }
                try:
                    succeeded = Run.open(file.parent).manifest.get("experiment_sha256") in done
                except KilotwinError:
                    continue
            if succeeded:
                shutil.rmtree(file.parent, ignore_errors=True)

    def summary(self, finished: int) -> dict[str, Any]:
        """The --json object."""
        return {
            "sweep": self.plan.keys.name,
            "status": "interrupted" if self.interrupted else "finished",
            "trials": len(self.plan.trials),
            "finished": finished,
            "damaged": self.damaged,
            "metrics_failed": self.data.spoiled(),
            "failed": [
                {"trial": shown(trial), **failure_line(self.failures[key])}
                for trial, key in zip(self.plan.trials, self.keys, strict=True)
                if key in self.failures
            ],
            "folder": str(self.data.folder),
        }

    @property
    def exit_code(self) -> int:
        """0, or 1 with failed or damaged trials, or that of an interruption."""
        if self.interrupted:
            return EXIT_INTERRUPTED
        return 1 if self.failures or self.damaged else 0

    def _take(self, attempt: "_Try", answer: Answer, progress: "_Progress") -> None:
        when = {"key": answer.key, "utc": utc_now()}
        if isinstance(answer, Failed):
            self.failures[answer.key] = answer
            self.data.log(**{**when, **failure_line(answer)})
        else:
            if answer.engine_sha256 != engine_sha256():
                raise RunError(
                    f"{answer.host} has another engine than this machine; install the same "
                    "Kilotwin on all workers"
                )
            self.data.add(answer)
            robot_s = _robot_s(attempt.trial)
            shutil.rmtree(attempt.task.folder, ignore_errors=True)
            self.data.log(**when, cpu_s=answer.cpu_s, robot_s=robot_s, host=answer.host)
            self.there.add(answer.key)
        progress.add(attempt.trial, failed=isinstance(answer, Failed))


@dataclass(frozen=True)
class _Try:
    trial: Trial
    task: Task
    how: Callable[[Task], Answer]

    def again(self) -> "_Try | None":
        """The second try, which leaves a run folder; None after it."""
        return None if self.how is measure_apart else _Try(self.trial, self.task, measure_apart)


def _answers(attempts: Sequence[_Try], place: Place) -> Iterator[tuple[_Try, Answer]]:
    """The answer to each, in any order. A broken executor is replaced, and what it ran repeated."""
    waiting = list(reversed(attempts))
    for _ in range(_BROKEN_MOST):
        running: dict[Future[Answer], _Try] = {}
        with place.open() as executor, contextlib.suppress(BrokenExecutor):
            yield from _drain(executor, place, waiting, running)
        # A trial that broke it does so in a process of its own the next time.
        lost = [attempt.again() or attempt for attempt in running.values()]
        waiting += [_clean(attempt) for attempt in lost]
        if not waiting:
            return
    raise RunError("workers die again and again; see to memory and disk, then go on with the sweep")


def _drain(
    executor: Executor, place: Place, waiting: list[_Try], running: dict[Future[Answer], _Try]
) -> Iterator[tuple[_Try, Answer]]:
    most = _WAITING_PER_WORKER * (place.workers() or _WORKERS_UNKNOWN)
    while waiting or running:
        while waiting and len(running) < most:
            attempt = waiting[-1]
            running[executor.submit(attempt.how, attempt.task)] = attempt
            waiting.pop()
        done, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in done:
            answer = _answer_of(future, running[future])
            attempt = running.pop(future)
            again = attempt.again()
            if isinstance(answer, Failed) and not answer.timed_out and again is not None:
                waiting.append(_clean(again))
            else:
                yield attempt, answer


def _answer_of(future: Future[Answer], attempt: _Try) -> Answer:
    """The trial's result; a worker that Dask lost for good counts as a failure of the trial."""
    try:
        return future.result()
    except BrokenExecutor:
        raise
    except Exception as error:
        return Failed(attempt.task.key, f"{type(error).__name__}: {error}", None)


def _clean(attempt: _Try) -> _Try:
    """Its run folder must not be there yet."""
    shutil.rmtree(attempt.task.folder, ignore_errors=True)
    return attempt


class _Progress:
    """Counts trials, and estimates the time left from that of the trials done."""

    def __init__(self, display: Display, missing: Sequence[tuple[Trial, str]], total: int) -> None:
        self._display = display
        self._began = time.monotonic()
        self._done, self._failed = total - len(missing), 0
        self._guessed_left_s = math.fsum(cpu_s_of(trial.experiment) for trial, _ in missing)
        self._guessed_done_s = 0.0

    def add(self, trial: Trial, *, failed: bool) -> None:
        self._failed += failed
        self._done += not failed
        self._guessed_done_s += cpu_s_of(trial.experiment)
        self._guessed_left_s -= cpu_s_of(trial.experiment)
        elapsed = time.monotonic() - self._began
        left_s = elapsed / self._guessed_done_s * max(self._guessed_left_s, 0.0)
        self._display.progress(self._done, self._failed, left_s, shown(trial))


def _robot_s(trial: Trial) -> float:
    return trial.experiment.size * trial.experiment.keys.duration_s


def _bytes(trial: Trial) -> float:
    keys = trial.experiment.keys
    return _BYTES_PER_TRIAL + _BYTES_PER_SAMPLE * keys.duration_s / keys.record.sample_s


def default_folder(plan: Plan) -> Path:
    """runs/sweep-<name>: the same every time, so that a sweep goes on by itself."""
    return Path("runs") / f"sweep-{slug(plan.keys.name)}"
