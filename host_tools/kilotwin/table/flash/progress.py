"""The display that long work reports to."""

from collections.abc import Callable
from typing import Protocol


class Progress(Protocol):
    """Steps, how far each is, and lines in between."""

    def step(self, text: str) -> None:
        """Something begins."""

    def part(self, share: float) -> None:
        """Share of it that is done, 0 to 1."""

    def note(self, text: str) -> None:
        """A line in between."""


def stepwise(progress: Progress) -> Callable[[str, float], None]:
    """For work that says often what it does, and its share: a new step where the text changes."""
    told = ""

    def show(text: str, share: float) -> None:
        nonlocal told
        if text != told:
            told = text
            progress.step(text)
        progress.part(share)

    return show
