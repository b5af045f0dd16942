"""Metrics that are variables of robots' programs, by the debug information of the build."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.programs.guest_symbols import GuestSymbols, NumberPlace

Numbers = NDArray[np.float64]

_REDUCED: dict[str, Callable[[Numbers], np.float64]] = {
    "mean": np.mean,
    "sum": np.sum,
    "least": np.min,
    "most": np.max,
}


class Variable:
    """One variable, in those robots whose program has it."""

    def __init__(self, experiment: Experiment, name: str, symbols: Sequence[Path | None]) -> None:
        """`symbols`: files of debug information, of each group's program. InputError if none has
        the variable."""
        metric = experiment.keys.metric[name]
        assert metric.variable is not None
        self._reduce = _REDUCED[metric.of]
        self._places: list[NumberPlace | None] = []
        complaint = "robots run on their ATmega328P, whose variables are not read"
        for group, file in zip(experiment.groups, symbols, strict=False):
            place: NumberPlace | None = None
            if file is not None and not group.on_board:
                try:
                    place = GuestSymbols(file).number(metric.variable)
                except InputError as error:
                    complaint = str(error)
            self._places += [place] * group.count
        if not any(self._places):
            raise experiment.error(("metric", name, "variable"), complaint)

    def read(self, state_of: Callable[[int], bytes]) -> Numbers:
        """[N]: each robot's, NaN for those without it."""
        return np.array(
            [
                np.nan if place is None else place.read(state_of(robot))
                for robot, place in enumerate(self._places)
            ]
        )

    def reduced(self, values: Numbers) -> float | None:
        """One value over the robots that have it and whose value is a number."""
        known = values[np.isfinite(values)]
        return float(self._reduce(known)) if len(known) else None
