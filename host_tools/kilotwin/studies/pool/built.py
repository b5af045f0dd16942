"""Programs of trials, built or found built once in each process that runs them."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kilotwin.experiment.experiment import Experiment, Group
from kilotwin.programs.cache import Notify
from kilotwin.programs.group import build_group, symbols_of
from kilotwin.programs.native.guest import Guest
from kilotwin.programs.variant import MARKED, Variant
from kilotwin.session.job import Job
from kilotwin.studies.pool.task import Task


@dataclass(frozen=True)
class Built:
    """The programs of an experiment: `guests` of its groups of robots, and of modules."""

    guests: tuple[Guest, ...]
    modules: Guest | None

    @property
    def keys(self) -> tuple[str, ...]:
        """Those of all of them."""
        return tuple(guest.key for guest in self.all)

    @property
    def all(self) -> list[Guest]:
        """Those of robots, then that of modules."""
        return [*self.guests, *([self.modules] if self.modules else [])]

    def job(self, experiment: Experiment, black_box: Path, *, variant: Variant) -> Job:
        """The job of a trial, which has no folder."""
        return Job(
            experiment,
            [str(guest.file) for guest in self.guests],
            Path(),
            {},
            str(black_box),
            "" if self.modules is None else str(self.modules.file),
            covered=variant in MARKED,
            symbols=symbols_of(self.guests, self.modules),
        )


class Builder:
    """Builds the programs of many experiments, each of them once."""

    def __init__(self, notify: Notify = lambda _: None, **how: Any) -> None:
        """`notify`, `how`: as build_group() has them."""
        self._notify, self._how = notify, how
        self._guests: dict[tuple[Any, ...], Guest] = {}

    def built(self, experiment: Experiment) -> Built:
        """The programs of a settled experiment; KilotwinError if one cannot be built."""
        guests = tuple(self._guest(group) for group in experiment.groups)
        modules = experiment.modules
        return Built(guests, None if modules is None else self._guest(modules))

    def _guest(self, group: Group) -> Guest:
        what = group.program, group.tier, group.boot_loader
        if what not in self._guests:
            self._guests[what] = build_group(group, self._notify, **self._how)
        return self._guests[what]


def built_for(task: Task[Any]) -> Built:
    """The task's programs in this process; KilotwinError if one cannot be built here."""
    return _builder(tuple(task.programs), task.variant, task.sanitized).built(task.experiment)


@functools.lru_cache(maxsize=64)
def _builder(programs: Sequence[str], variant: Variant, sanitized: bool) -> Builder:
    """Sources that have changed have other keys, and so another builder."""
    return Builder(variant=variant, sanitized=sanitized)
