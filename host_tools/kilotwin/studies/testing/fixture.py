"""The object behind the fixtures: makes worlds, remembers them, keeps them if the test fails."""

import contextlib
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from kilotwin.errors import InputError, KilotwinError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import Setting, parse_setting
from kilotwin.programs.port.trial import Trial
from kilotwin.runs.folder import slug
from kilotwin.session.display import NoDisplay
from kilotwin.session.run import run
from kilotwin.studies.scenario import program_check as checks
from kilotwin.studies.scenario.kept_failures import free
from kilotwin.studies.testing.plugin import draw
from kilotwin.studies.testing.recorded_world import RecordedWorld

_NO_PULSES = 'medium.kind = "ideal"'


class Kilotwin:
    """Worlds and runs of a test. `seed`: of those that name none; a seed of the marker."""

    def __init__(self, folder: Path, *, cpu: str | None, artifacts: Path, video: bool) -> None:
        self.folder = folder
        """The folder of the test's file, where relative paths begin."""
        self.seed = 1
        self._cpu, self._artifacts, self._video = cpu, artifacts, video
        self._worlds: list[RecordedWorld] = []
        self._runs: list[Path] = []

    def world(self, experiment: str | Path | None = None, **keys: Any) -> RecordedWorld:
        """A World of an experiment or of keys, as World takes them."""
        keys.setdefault("seed", self.seed)
        if self._cpu is not None:
            given = keys.get("set", [])
            settings = [given] if isinstance(given, str) else list(given)
            keys["set"] = [f"swarm.cpu={self._cpu}", *settings]
        try:
            with contextlib.chdir(self.folder):
                made = RecordedWorld(experiment, **keys)
        except InputError as error:
            self._skip_without_pulses(error)
            raise
        self._worlds.append(made)
        return made

    def run(
        self, experiment: str | Path, *settings: str, timeout_s: float | None = None
    ) -> dict[str, Any]:
        """Runs an experiment as `kilotwin run` does; returns its summary, as --json prints it."""
        given = [parse_setting(text) for text in settings]
        if not any(setting.keys == ("seed",) for setting in given):
            given.insert(0, Setting(("seed",), self.seed, f"seed {self.seed}"))
        if self._cpu is not None:
            given.insert(0, parse_setting(f"swarm.cpu={self._cpu}"))
        try:
            with contextlib.chdir(self.folder):
                loaded = Experiment.load(Path(experiment), given)
        except InputError as error:
            self._skip_without_pulses(error)
            raise
        name = f"{slug(loaded.keys.name)}-seed{loaded.keys.seed}"
        folder = free(self._artifacts / f"{name}-run{len(self._runs) + 1}")
        self._runs.append(folder)
        outcome = run(loaded, folder, sys.argv, NoDisplay(), timeout_s=timeout_s)
        return outcome.summary

    def check(
        self,
        *program: str,
        include: Sequence[str] = (),
        define: Sequence[str] = (),
        flash: int | None = None,
        ram: int | None = None,
        stack: int | None = None,
        seconds: float = 20,
    ) -> None:
        """Fails for what `kilotwin check` finds wrong with a program, without its scenarios."""
        __tracebackhide__ = True
        with contextlib.chdir(self.folder):
            found = checks.program_of(program, include, define)
            steps = [checks.on_this_computer(found, _say_nothing)]
            trial = Trial(seconds, self.seed)
            step, report = checks.on_the_chip(program, include, define, trial, _say_nothing)
        steps.append(step)
        if report is not None:
            steps.append(checks.size(report, checks.Budget(flash, ram, stack)))
        if wrong := [step.text() for step in steps if step.fails]:
            raise AssertionError("\n".join(wrong))

    def keep(self, name: str) -> list[Path]:
        """Writes run folders of all that was made, for a test of that name."""
        kept = []
        for number, made in enumerate(self._worlds, start=1):
            which = f"-world{number}" if len(self._worlds) > 1 else ""
            folder = free(self._artifacts / f"{slug(name)}-seed{made.seed}{which}")
            with contextlib.suppress(KilotwinError, OSError):
                made.keep(folder)
                kept.append(folder)
        kept += self._runs
        self._runs = []
        return kept

    def lines_on(self, kept: list[Path]) -> list[str]:
        """Draws maps of what was kept; how to look at it."""
        for folder in kept:
            with contextlib.suppress(KilotwinError):
                draw(folder, video=self._video)
        return [kept_line(folder) for folder in kept]

    def close(self) -> None:
        """Frees all worlds, and removes runs that were not kept."""
        for made in self._worlds:
            made.close()
        for folder in self._runs:
            free(folder)

    def _skip_without_pulses(self, error: InputError) -> None:
        if self._cpu == "avr" and _NO_PULSES in str(error):
            pytest.skip("on an ATmega328P robots send pulses, which the ideal medium has not")


def _say_nothing(line: str) -> None:
    """Progress is not for a test's report."""


def kept_line(folder: Path) -> str:
    """How to look at it."""
    shown = os.path.relpath(folder)
    return f"kept: {shown}; look at it: kilotwin view {shown}"
