"""Progress of runs and sweeps on a terminal, as bars by rich."""

import time
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console, RenderableType
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from kilotwin.commands.terminal import HowFar, robots_now, simulated, sweep_done, sweep_now
from kilotwin.experiment.experiment import Experiment
from kilotwin.session.display import NO_VALUES, Values
from kilotwin.units import seconds, ticks


class _BarAndLine(Progress):
    """rich's progress with a line of text below."""

    line = ""

    def get_renderables(self) -> Iterable[RenderableType]:
        yield self.make_tasks_table(self.tasks)
        yield Text(self.line)


class _Live:
    """A bar on stderr with a line below, and notes above."""

    def __init__(self, *columns: ProgressColumn) -> None:
        self._console = Console(stderr=True)
        self._bar = _BarAndLine(
            BarColumn(bar_width=20),
            TextColumn("{task.description}"),
            *columns,
            console=self._console,
            transient=True,
        )
        self._task = TaskID(0)

    def note(self, text: str) -> None:
        """One line above."""
        self._console.print(text, style="dim", markup=False, highlight=False)

    def warn(self, text: str) -> None:
        """One line above, that is seen."""
        self._console.print(text, style="bold red", markup=False, highlight=False)

    def stop(self) -> None:
        """Removes the bar."""
        self._bar.stop()


class Bar(_Live):
    """How far, how fast, how long still; and the robots per site."""

    def __init__(self, how_far: HowFar = simulated) -> None:
        super().__init__(TextColumn("left"), TimeRemainingColumn())
        self._how_far = how_far
        self._began = time.monotonic()
        self._duration_s = 0.0

    def start(self, experiment: Experiment, folder: Path) -> None:
        """Shows the bar."""
        self.note(f"{experiment.keys.name}, seed {experiment.keys.seed}")
        self._duration_s = experiment.keys.duration_s
        self._task = self._bar.add_task("", total=ticks(self._duration_s))
        self._bar.start()
        self._began = time.monotonic()

    def progress(
        self, tick: int, resting: dict[str, int], not_resting: int, metrics: Values = NO_VALUES
    ) -> None:
        """Moves the bar."""
        wall_s = max(time.monotonic() - self._began, 1e-3)
        self._bar.line = robots_now(resting, not_resting, metrics)
        self._bar.update(
            self._task,
            completed=tick,
            description=self._how_far(seconds(tick), wall_s, self._duration_s),
        )


class SweepBar(_Live):
    """How many trials, and the last one below."""

    def __init__(self) -> None:
        super().__init__()
        self._trials = 0

    def start(self, trials: int, done: int) -> None:
        """Shows the bar."""
        self._trials = trials
        text = sweep_done(done, trials)
        self._task = self._bar.add_task(text, total=trials or None, completed=done)
        self._bar.start()

    def progress(self, done: int, failed: int, left_s: float, last: str) -> None:
        """Moves the bar."""
        self._bar.line = last
        text = sweep_now(done, self._trials, failed, left_s)
        self._bar.update(self._task, completed=done, description=text)
