"""A trial as a study hands it to the pool, and what comes back of it."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from kilotwin.experiment.experiment import Experiment
from kilotwin.files import confinement
from kilotwin.programs.variant import Variant
from kilotwin.session.job import Job
from kilotwin.session.recorder import WriterT
from kilotwin.session.trial import Trial

T = TypeVar("T")
"""The part of a trial that a study wants to have."""


@dataclass(frozen=True)
class Ran(Generic[WriterT]):
    """A trial that ran to its end, in the process in which it ran: its `summary` as --json has it,
    and its `trial`, with the writer that the outcome made."""

    job: Job
    trial: Trial[WriterT]
    summary: dict[str, Any]


class Outcome(ABC, Generic[WriterT, T]):
    """The part of a trial that a study wants to have, and how it crosses from the process in which
    programs run. It is pickled with its task: a class of a module, best without anything in it.
    """

    @abstractmethod
    def writer(self, experiment: Experiment) -> WriterT:
        """Takes the trial's samples and events, in place of the writer of a run folder."""

    def run(self, trial: Trial[WriterT], stopped: Callable[[], bool]) -> bool:
        """Runs the trial, in its process; False if `stopped` before its end."""
        return trial.run(stopped)

    @abstractmethod
    def answer(self, ran: Ran[WriterT]) -> bytes:
        """The outcome as bytes, in the trial's process. A KilotwinError: the trial failed."""

    @abstractmethod
    def understood(self, task: "Task[T]", said: bytes) -> T:
        """The outcome of these bytes, outside of the trial's process. A program may have written
        them: a ValueError, KeyError or TypeError of what is none."""


@dataclass(frozen=True)
class Task(Generic[T]):
    """One trial.

    `programs`: keys of its built programs (programs_of()), by which a worker knows them again.
    `timeout_s`: wall time that it may take; `timeout_name`: the key that says so, for messages.
    `trusted`: its programs are (--trust), wherever it runs. `variant`, `sanitized`: as
    build_group() has them.
    """

    experiment: Experiment
    outcome: Outcome[Any, T]
    programs: Sequence[str]
    timeout_s: float | None = None
    timeout_name: str = ""
    trusted: bool = False
    variant: Variant = "plain"
    sanitized: bool = False

    @property
    def seed(self) -> int:
        """The trial's."""
        return self.experiment.keys.seed

    @staticmethod
    def trusts() -> bool:
        """Whether programs are trusted where a study begins."""
        return confinement.mode() == "off"

    def stopped_after(self) -> str:
        """`stopped after trial_timeout_s = 8`."""
        name = f"{self.timeout_name} = " if self.timeout_name else ""
        unit = "" if self.timeout_name else " s"
        return f"stopped after {name}{self.timeout_s:g}{unit}"

    def stopped_when(self, summary: dict[str, Any]) -> str:
        """The same, and how far it came by its summary."""
        came = f"{summary['simulated_s']:,.1f} of {summary['duration_s']:,g} s were simulated"
        return f"{self.stopped_after()}, when {came}"


@dataclass(frozen=True)
class Done(Generic[T]):
    """A trial's outcome, and how it came: CPU time, engine, machine."""

    value: T
    cpu_s: float
    engine_sha256: str
    host: str


@dataclass(frozen=True)
class Failed:
    """A trial that failed: why, and the run folder it left, if any.

    `timed_out`: it took too long, and would again.
    """

    reason: str
    timed_out: bool = False
    folder: Path | None = None


Answer = Done[T] | Failed
