"""Scenario files as tests of pytest: an item a file."""

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from kilotwin.errors import InputError, KilotwinError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import parse_setting
from kilotwin.studies.scenario.judge import judge, runs_of
from kilotwin.studies.scenario.kept_failures import keep
from kilotwin.studies.scenario.one_run import run_once, tasks_of, with_seed
from kilotwin.studies.scenario.runner import is_scenario
from kilotwin.studies.testing.fixture import kept_line
from kilotwin.studies.testing.plugin import KEPT, draw

_TIMEOUT_S = 600.0


class NotMetError(Exception):
    """Lines about what was expected and not met."""


def collected(file: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """The file's collector, if it is a scenario."""
    if not is_scenario(file):
        return None
    made: pytest.Collector = ScenarioFile.from_parent(parent, path=file)
    return made


class ScenarioFile(pytest.File):
    """A TOML file with [[expect]]."""

    def collect(self) -> Iterator[pytest.Item]:
        """One item: its expectations share their runs."""
        yield ScenarioItem.from_parent(self, name="expect")


class ScenarioItem(pytest.Item):
    """All expectations of a file."""

    def runtest(self) -> None:
        """Runs it with all seeds."""
        cpu = self.config.getoption("--kilotwin-cpu")
        settings = [parse_setting(f"swarm.cpu={cpu}")] if cpu is not None else []
        experiment = Experiment.load(self.path, settings)
        tasks = tasks_of(experiment, runs_of(experiment), _TIMEOUT_S, lambda _: None)
        verdicts = judge(experiment, [run_once(task) for task in tasks])
        failures = [verdict for verdict in verdicts if not verdict.passed]
        if not failures:
            return
        if (seed := failures[0].seed) is not None:
            self._keep(with_seed(experiment, seed))
        raise NotMetError("\n".join(verdict.line() for verdict in failures))

    def _keep(self, experiment: Experiment) -> None:
        below = self.config.rootpath / self.config.getoption("--kilotwin-artifacts")
        folder = keep(experiment, sys.argv, _TIMEOUT_S, below)
        if folder is not None:
            with contextlib.suppress(KilotwinError):
                draw(folder, video=self.config.getoption("--kilotwin-video"))
            self.stash[KEPT] = [kept_line(folder)]

    def repr_failure(
        self, excinfo: "pytest.ExceptionInfo[BaseException]", style: Any = None
    ) -> Any:
        """The lines alone, without a traceback of ours."""
        if isinstance(excinfo.value, NotMetError):
            return str(excinfo.value)
        if isinstance(excinfo.value, KilotwinError | InputError):
            detail = excinfo.value.detail
            return f"{excinfo.value}\n{detail}" if detail else str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Its name in reports."""
        return self.path, None, f"scenario {self.path.name}"
