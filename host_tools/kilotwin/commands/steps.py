"""Progress of short jobs on stderr, step by step. Loads no experiments, so it starts at once."""

import sys
from collections.abc import Callable

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn


class Lines:
    """A line when a step begins."""

    def step(self, text: str) -> None:
        """Something begins."""
        self.note(text)

    def part(self, share: float) -> None:
        """Nothing: a step is over soon."""

    def note(self, text: str) -> None:
        """One line."""
        typer.echo(text, err=True)

    def stop(self) -> None:
        """Nothing to tidy up."""


class Silent(Lines):
    """Shows nothing but notes."""

    def step(self, text: str) -> None:
        """Nothing."""


class Bar:
    """A bar for the step that is going on, with the time that it still takes."""

    def __init__(self) -> None:
        self._console = Console(stderr=True)
        self._bar = Progress(
            BarColumn(bar_width=20),
            TextColumn("{task.description}"),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=self._console,
            transient=True,
        )
        self._task: TaskID | None = None

    def step(self, text: str) -> None:
        """Begins the bar anew."""
        if self._task is not None:
            self._bar.remove_task(self._task)
        self._task = self._bar.add_task(text, total=1.0)
        self._bar.start()

    def part(self, share: float) -> None:
        """Moves the bar."""
        if self._task is not None:
            self._bar.update(self._task, completed=share)

    def note(self, text: str) -> None:
        """One line above."""
        self._console.print(text, style="dim", markup=False, highlight=False)

    def stop(self) -> None:
        """Removes the bar, until the next step."""
        self._bar.stop()


def display(quiet: bool) -> Lines | Bar:
    """A live bar on a terminal, a line per step elsewhere, only notes if `quiet`."""
    if quiet:
        return Silent()
    return Bar() if sys.stderr.isatty() else Lines()


def note(quiet: bool) -> Callable[[str], None]:
    """Prints a line on stderr, or nothing if `quiet`."""
    return (lambda _: None) if quiet else Lines().note
