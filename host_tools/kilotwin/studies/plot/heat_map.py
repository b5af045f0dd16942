"""Heat maps: cells by two keys, shades of grey, and numbers where there is room."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from kilotwin.studies.plot.style import letters
from kilotwin.studies.sweep.results import ordered, shown

Cells = Mapping[tuple[Any, Any], float]
"""Values by row and column; NaN for none."""

SHADES = "gray_r"  # white is 0
_NO_VALUE = "#cfe3f2"
_NUMBERED = 40  # cells on a side up to which each shows its number


def value_labels(values: Iterable[Any]) -> dict[Any, str]:
    """Each number in as few digits as distinguish all of them, from three to six; texts as such."""
    several = set(values)
    if not all(isinstance(value, int | float) for value in several):
        return {value: shown(value) for value in several}
    digits = 3
    while digits < 6 and len({f"{value:.{digits}g}" for value in several}) < len(several):
        digits += 1
    return {value: f"{value:.{digits}g}" for value in several}


@dataclass(frozen=True)
class Look:
    """Measures that all heat maps of a figure share. Sizes in inches, of a map with its labels."""

    width: float
    height: float
    is_numbered: bool
    every: int
    """Which cells of a row and of a column have their value at the rim: every second, ..."""
    rotation: int


def look_of(maps: Sequence[Cells]) -> Look:
    """Cells that have room for their numbers; of very many, small ones without."""
    ups = [value_labels(row for row, _ in cells).values() for cells in maps]
    acrosses = [value_labels(column for _, column in cells).values() for cells in maps]
    up, across = max(map(len, ups)), max(map(len, acrosses))
    is_numbered = max(across, up) <= _NUMBERED
    longest = max(len(f"{value:.4g}") for cells in maps for value in cells.values())
    cell = letters(longest, 8) + 0.05 if is_numbered else 0.1
    beside = 0.3 + letters(max(len(label) for labels in ups for label in labels))
    below = letters(max(len(label) for labels in acrosses for label in labels))
    width = max(2.9, across * cell + beside)
    is_upright = below > (width - beside) / across
    height = max(2.9, up * (0.24 if is_numbered else 0.1) + 1.05) + below * is_upright
    return Look(width, height, is_numbered, 1 if is_numbered else 2, 90 * is_upright)


def draw_map(axes: Axes, cells: Cells, look: Look, top: float, bottom: float = 0.0) -> None:
    """White is `bottom`, black `top`; pale blue what has no value."""
    up = sorted({row for row, _ in cells}, key=ordered)
    across = sorted({column for _, column in cells}, key=ordered)
    values: NDArray[np.float64] = np.full((len(up), len(across)), np.nan)
    for (row, column), value in cells.items():
        x, y = across.index(column), up.index(row)
        values[y, x] = value
        if look.is_numbered:
            colour = "white" if value > 0.5 * (bottom + top) else "black"
            text = "\N{EN DASH}" if math.isnan(value) else f"{value:.4g}"
            axes.text(x, y, text, ha="center", va="center", fontsize=8, color=colour)
    axes.imshow(
        np.ma.masked_invalid(values),
        origin="lower",
        cmap=SHADES,
        vmin=bottom,
        vmax=top,
        aspect="auto",
    )
    axes.set_facecolor(_NO_VALUE)
    for set_ticks, values_of, rotation in (
        (axes.set_xticks, across, look.rotation),
        (axes.set_yticks, up, 0),
    ):
        labels = value_labels(values_of)
        places = range(0, len(values_of), look.every)
        set_ticks(places, [labels[values_of[place]] for place in places], rotation=rotation)
    axes.spines[["top", "right"]].set_visible(True)
