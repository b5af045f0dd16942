"""Interface through which a run shows its progress; the command line implements it."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

from kilotwin.experiment.experiment import Experiment
from kilotwin.files.plain_text import plain

Values = Mapping[str, float | None]
"""Metrics by name; None of what has no value."""
NO_VALUES: Values = {}


class Display(Protocol):
    """Shows a run while it goes on."""

    def note(self, text: str) -> None:
        """Shows what is being prepared."""

    def warn(self, text: str) -> None:
        """Shows what cannot wait for the end, also where nothing else is shown."""

    def start(self, experiment: Experiment, folder: Path) -> None:
        """The run begins."""

    def progress(
        self, tick: int, resting: dict[str, int], not_resting: int, metrics: Values = NO_VALUES
    ) -> None:
        """The run has come to `tick`; robots at rest per site, and not at rest; metrics by name."""

    def stop(self) -> None:
        """The run is over, one way or another."""


class Window(Protocol):
    """Shows a run elsewhere, from its folder and by a link to its process (live_link.py)."""

    @property
    def run_end(self) -> int:
        """The descriptor of the link's end that the run's process inherits."""

    def handed_over(self) -> None:
        """It has it: closes ours."""

    def open(self, folder: Path) -> None:
        """The run has begun, and this is its folder."""


class NoDisplay:
    """Shows nothing."""

    def note(self, text: str) -> None:
        """Nothing."""

    def warn(self, text: str) -> None:
        """Nothing."""

    def start(self, experiment: Experiment, folder: Path) -> None:
        """Nothing."""

    def progress(
        self, tick: int, resting: dict[str, int], not_resting: int, metrics: Values = NO_VALUES
    ) -> None:
        """Nothing."""

    def stop(self) -> None:
        """Nothing."""


class Silent(NoDisplay):
    """Shows nothing but warnings."""

    def warn(self, text: str) -> None:
        """One line."""
        sys.stderr.write(f"{plain(text)}\n")
