"""Runs scenarios: finds their files, and runs them in processes."""

import signal
import time
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from kilotwin.errors import InputError, InterruptError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import Setting
from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.programs.cache import Notify
from kilotwin.programs.coverage.checks import COVERED, check_covered
from kilotwin.programs.native.sanitizer import SANITIZED, check_sanitized
from kilotwin.programs.variant import Variant
from kilotwin.runs.folder import EXPERIMENT, MANIFEST
from kilotwin.studies.pool.places import Processes
from kilotwin.studies.pool.pool import Pool
from kilotwin.studies.pool.task import Task
from kilotwin.studies.scenario.judge import ScenarioVerdict, judge, runs_of
from kilotwin.studies.scenario.one_run import Ran, ran_of, tasks_of
from kilotwin.studies.sweep.runner import Display

_SKIPPED = {"runs", "build", "node_modules"}


@dataclass
class Scenario:
    """An experiment with [[expect]], and what came of it."""

    experiment: Experiment
    tasks: list[Task[Ran]]
    ran: dict[int, Ran] = field(default_factory=dict)
    verdicts: list[ScenarioVerdict] = field(default_factory=list)
    took_s: float = 0.0
    folder: Path | None = None
    """A run folder of a run that failed."""

    @property
    def name(self) -> str:
        """Its file."""
        return self.experiment.origin.source

    @property
    def done(self) -> bool:
        """Whether all runs are there."""
        return len(self.ran) == len(self.tasks)

    @property
    def failures(self) -> list[ScenarioVerdict]:
        """The expectations that were not met."""
        return [verdict for verdict in self.verdicts if not verdict.passed]

    @property
    def timed_out(self) -> bool:
        """Whether a run took too long."""
        return any(ran.timed_out for ran in self.ran.values())


def is_scenario(file: Path) -> bool:
    """Whether it is a TOML file with an [[expect]], and not the copy that a run folder has."""
    if file.name == EXPERIMENT and (file.parent / MANIFEST).exists():
        return False
    try:
        text = file.read_text(encoding="utf-8")
        return "expect" in text and isinstance(tomllib.loads(text).get("expect"), list)
    except (OSError, ValueError, RecursionError):
        return False


def find(given: Sequence[Path]) -> list[Path]:
    """The scenario files: those given, those in folders that are given, or all below this one.

    Hidden folders, and those that runs and builds leave, are passed over.
    """
    files: list[Path] = []
    for path in given or [Path()]:
        if path.is_dir():
            inside = (file for file in sorted(path.rglob("*.toml")) if not _is_left(file, path))
            files += [file for file in inside if is_scenario(file)]
        else:
            files.append(path)
    if not files:
        where = ", ".join(map(str, given)) or "this folder"
        raise InputError(
            f"{where}: no experiment with [[expect]]; add one to an experiment, as docs/testing.md "
            "shows, or name a file"
        )
    return list(dict.fromkeys(files))


def _is_left(file: Path, below: Path) -> bool:
    folders = file.relative_to(below).parts[:-1]
    return any(part in _SKIPPED or part.startswith(".") for part in folders)


def prepare(
    files: Iterable[Path],
    settings: list[Setting],
    timeout_s: float,
    notify: Notify,
    *,
    covered: bool = False,
    sanitized: bool = False,
) -> list[Scenario]:
    """Loads all files, then builds their programs; InputError names what cannot be used. `covered`:
    programs run translated, and mark what runs; `sanitized`: natively, and look for undefined
    behaviour."""
    settings = [*([COVERED] if covered else []), *([SANITIZED] if sanitized else []), *settings]
    loaded = [Experiment.load(file, settings) for file in files]
    for experiment in loaded:
        if not experiment.keys.expect:
            raise InputError(
                f"{experiment.origin.source}: has no [[expect]]; add one, as docs/testing.md shows"
            )
        if covered:
            check_covered(experiment)
        if sanitized:
            check_sanitized(experiment)
    variant: Variant = "covered" if covered else "plain"
    return [
        Scenario(
            one,
            tasks_of(one, runs_of(one), timeout_s, notify, variant=variant, sanitized=sanitized),
        )
        for one in loaded
    ]


def run_all(
    scenarios: Sequence[Scenario], place: Processes, display: Display
) -> Iterator[Scenario]:
    """Each scenario when its last run is there, with its verdicts."""
    total = sum(len(scenario.tasks) for scenario in scenarios)
    display.start(total, 0)
    began = time.monotonic()
    left = sum(_size(task) for scenario in scenarios for task in scenario.tasks)
    all_of_it, done, failed = left, 0, 0
    try:
        runs = [(scenario, task) for scenario in scenarios for task in scenario.tasks]
        with heeding_interrupts(signal.default_int_handler), Pool(place) as pool:
            for index, answer in pool.answers([task for _, task in runs]):
                scenario, task = runs[index]
                scenario.ran[task.seed] = ran_of(task, answer)
                done, left = done + 1, left - _size(task)
                scenario.took_s = time.monotonic() - began
                if scenario.done:
                    of_all = [scenario.ran[one.seed] for one in scenario.tasks]
                    scenario.verdicts = judge(scenario.experiment, of_all)
                    failed += bool(scenario.failures)
                took_s = time.monotonic() - began
                left_s = took_s * left / max(all_of_it - left, 1e-9)
                display.progress(done, failed, left_s, scenario.name)
                if scenario.done:
                    yield scenario
    except KeyboardInterrupt:
        raise InterruptError("interrupted; scenarios without a row have no verdict") from None
    finally:
        display.stop()


def _size(task: Task[Ran]) -> float:
    """So much work is it, more or less."""
    return task.experiment.size * task.experiment.keys.duration_s
