"""Faster code of the programs of a run, taken over while it goes on (translate/translation.py)."""

import contextlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from kilotwin import _emulator
from kilotwin.experiment.experiment import Experiment
from kilotwin.programs.native.guest import Guest
from kilotwin.session.loop import Companion

Files = tuple[str, str]
"""The code that robots begin with, and where the faster one will be."""


def expected(experiment: Experiment, guests: Sequence[Guest]) -> tuple[Files, ...]:
    """The faster code that may come for an experiment's groups, by the guest of each."""
    pairs = zip(experiment.groups, guests, strict=True)
    return tuple(
        (str(guest.file), str(guest.optimised))
        for group, guest in pairs
        if group.tier == "translated" and guest.optimised is not None
    )


def runs_native_code(experiment: Experiment) -> bool:
    """Whether programs run as the compiler made them: their process is closed to all later code."""
    groups = [*experiment.groups, *([experiment.modules] if experiment.modules else [])]
    return any(group.tier == "native" for group in groups)


class FasterCode(Companion):
    """Looks for it between two steps, and takes it: what robots do is the same before and after."""

    def __init__(
        self, files: Iterable[Files], taken: Callable[[int], None] = lambda _: None
    ) -> None:
        """`taken` is called with the tick at which the last that was expected is there."""
        self._expected = list(files)
        self._taken = taken

    def step(self, now: int) -> None:
        """Takes what is there."""
        there = [files for files in self._expected if Path(files[1]).exists()]
        for loaded, faster in there:
            # A file that is damaged costs speed alone.
            with contextlib.suppress(_emulator.EngineError):
                _emulator.take_over(loaded, faster)
            self._expected.remove((loaded, faster))
        if there and not self._expected:
            _emulator.end_loading()
            self._taken(now)
