"""Runs what of a plan is not there yet, and keeps what comes back."""

import math
import shutil
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

from kilotwin.errors import EXIT_INTERRUPTED, KilotwinError, RunError
from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.programs.cache import Notify
from kilotwin.programs.group import settled
from kilotwin.programs.port.twin import Mode, Native, Twins, native_kilobots
from kilotwin.runs.folder import EXPERIMENT, slug, utc_now
from kilotwin.runs.reader import Run
from kilotwin.session.estimate import cpu_s_of
from kilotwin.studies.pool.built import Builder
from kilotwin.studies.pool.places import Place
from kilotwin.studies.pool.pool import Pool
from kilotwin.studies.pool.series import engine_sha256
from kilotwin.studies.pool.task import Answer, Failed, Task
from kilotwin.studies.sweep.data_set import DataSet, failure_line, trial_key
from kilotwin.studies.sweep.measure import TIMEOUT, Apart, Rows
from kilotwin.studies.sweep.plan import Plan, Trial, shown
from kilotwin.units import counted, duration_text

# From here on a sweep waits for the faster code of its programs before it begins.
_LONG_CPU_S = 60.0
_BYTES_PER_SAMPLE = 8
_BYTES_PER_TRIAL = 4096


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

    `keys` are the trials' in the order of the plan, `programs` those of what they run, `there`
    those of the finished ones; `native` are the programs of Kilobots that run natively.
    """

    plan: Plan
    data: DataSet
    keys: Sequence[str]
    there: set[str] = field(default_factory=set)
    native: Sequence[Native] = ()
    programs: Sequence[tuple[str, ...]] = ()
    failures: dict[str, Failed] = field(default_factory=dict)
    interrupted: bool = False
    damaged: int = 0

    @staticmethod
    def prepare(plan: Plan, folder: Path, notify: Notify) -> "Sweep":
        """Builds the programs, looks what is in the folder, and writes nothing into it."""
        data = DataSet.at(folder, engine_sha256())
        keys: list[str] = []
        programs: list[tuple[str, ...]] = []
        native: list[Native] = []
        at_once = sum(cpu_s_of(trial.experiment) for trial in plan.trials) < _LONG_CPU_S
        notes = {note: None for trial in plan.trials for note in trial.experiment.notes()}
        plan = _settled(plan, lambda note: notes.update({note: None}))
        for note in notes:
            notify(note)
        builder = Builder(notify, at_once=at_once)
        for trial in plan.trials:
            built = builder.built(trial.experiment)
            native += native_kilobots(trial.experiment, built.all)
            programs.append(built.keys)
            named = [*built.keys]
            if trial.experiment.environment is not None:
                named.append(trial.experiment.environment.sha256())
            named += [one.sha256() for one in trial.experiment.functions.values()]
            if trial.experiment.wire is not None:
                named.append(trial.experiment.wire.sha256())
            keys.append(trial_key(trial, named))
        there = {key for key in keys if key in data.parts}
        if damaged := data.parts.damaged:
            notify(
                f"{folder / 'parts'}: damaged at {counted(len(damaged), 'place')}, the first at "
                f"byte {damaged[0]}; trials that stood there are run again"
            )
        return Sweep(plan, data, keys, there, native, programs)

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

    def run(self, pool: Pool, display: Display, twin: Mode = "off") -> None:
        """Runs what is missing; a failed trial once more.

        Ctrl-C, or a polite kill, loses what is being run only.
        """
        missing = self.missing()
        twins = Twins(self.native if missing else (), twin, display.note)
        self.data.begin(self.plan, self.keys)
        total = len(self.plan.trials)
        display.start(total, total - len(missing))
        progress = _Progress(display, missing, total)
        try:
            with heeding_interrupts(signal.default_int_handler):
                for index, answer in pool.answers(self._tasks(missing), self._again(missing)):
                    self._take(*missing[index], answer, progress)
        except KeyboardInterrupt:
            self.interrupted = True
        finally:
            display.stop()
        if not self.interrupted:
            twins.verdicts()

    def _tasks(self, missing: Sequence[tuple[Trial, str]]) -> list[Task[bytes]]:
        trusted, rows = Task.trusts(), Rows()
        return [
            Task(
                trial.experiment,
                rows,
                self.programs[trial.index],
                self.plan.keys.trial_timeout_s,
                TIMEOUT,
                trusted,
            )
            for trial, _ in missing
        ]

    def _again(self, missing: Sequence[tuple[Trial, str]]) -> Callable[[int], Apart]:
        """The second try of each, which leaves a run folder."""
        tasks = self._tasks(missing)

        def apart(index: int) -> Apart:
            folder = self.data.failed_folder(missing[index][1]).absolute()
            shutil.rmtree(folder, ignore_errors=True)
            return Apart(tasks[index], folder)

        return apart

    def finish(self) -> int:
        """Writes the tables of all that is there; returns the number of trials in them."""
        self._clear_failed()
        finished = self.data.assemble(self.plan, self.keys)
        self.damaged = max(0, len(self.there) - finished)
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
                {"trial": shown(trial), **failure_line(key, self.failures[key])}
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

    def _take(self, trial: Trial, key: str, answer: Answer[bytes], progress: "_Progress") -> None:
        when = {"key": key, "utc": utc_now()}
        if isinstance(answer, Failed):
            self.failures[key] = answer
            self.data.log(**{**when, **failure_line(key, answer)})
        else:
            if answer.engine_sha256 != engine_sha256():
                raise RunError(
                    f"{answer.host} has another engine than this machine; install the same "
                    "Kilotwin on all workers"
                )
            self.data.add(key, answer.value)
            shutil.rmtree(self.data.failed_folder(key), ignore_errors=True)
            self.data.log(**when, cpu_s=answer.cpu_s, robot_s=_robot_s(trial), host=answer.host)
            self.there.add(key)
        progress.add(trial, failed=isinstance(answer, Failed))


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
