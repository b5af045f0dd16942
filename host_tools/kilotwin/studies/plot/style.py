"""The look of all figures: sizes, type, lines and marks; colours are in palette.py."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from kilotwin.files.drafts import draft_of
from kilotwin.runs.reader import Run

LEGEND_LINE = 0.235
"""Inches from one entry of a run's legend to the next."""

# Marks of the second, third, ... site of one colour: areas and lines.
HATCHES = ["", "////", "....", "xxxx", "||||"]
DASHES: list[Any] = ["-", (0, (5, 1.5)), (0, (2, 1)), (0, (5, 1, 1, 1)), (0, (1, 1.5))]

# Okabe and Ito's. A line has a colour and a marker of its own; the second six are open and dashed.
_LINE_COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"]
_LINE_MARKERS = ["o", "s", "^", "D", "v", "P"]
MOST_LINES = 2 * len(_LINE_COLOURS)
"""Lines that one figure can tell apart."""

_SETTINGS: dict[Any, Any] = {
    "figure.dpi": 150,
    "savefig.dpi": 200,
    "font.size": 11,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 12,
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "text.parse_math": False,  # a dollar in a name is a dollar
    "svg.hashsalt": "kilotwin",
    "pdf.fonttype": 42,
}


def draw(drawing: Callable[[], Figure]) -> Figure:
    """Draws in our style, whatever the user's matplotlib settings."""
    with mpl.rc_context(_SETTINGS):
        figure = drawing()
        figure.draw_without_rendering()  # the layout is settled at the second time only
        return figure


def save(figure: Figure, target: Path) -> None:
    """Writes the picture without the time of day, so that the same run gives the same file."""
    suffix = target.suffix.lower()
    undated = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}, ".png": {}}[suffix]
    with mpl.rc_context(_SETTINGS), draft_of(target) as draft:
        figure.savefig(draft, format=suffix[1:], metadata=undated, bbox_inches="tight")


def wrapped(text: str, inches: float, points: float = 11) -> str:
    """In lines of about that width, of at least ten letters; a no-break space does not break."""
    return fill(text, max(10, int(inches / letters(1, points))))


def letters(count: int, points: float = 11) -> float:
    """The width of so many letters of a common text, inches."""
    return count * 0.6 * points / 72


def repeats(fills: Sequence[str], ways: Sequence[Any]) -> list[Any]:
    """For each colour one of `ways`: the first where it is new, the next where it comes again."""
    return [ways[fills[:index].count(one) % len(ways)] for index, one in enumerate(fills)]


def legend_columns(labels: Sequence[str], height: float) -> int:
    """In how many columns a legend of these labels is no higher than so many inches."""
    lines = sum(1 + label.count("\n") for label in labels)
    return -(-lines // max(1, int(height / LEGEND_LINE)))


def title(run: Run) -> str:
    """Which run this is, for the top of a figure."""
    return f"{run.experiment.name}, seed {run.experiment.seed}"


def line_look(place: int) -> dict[str, Any]:
    """Colour, marker and line of line number `place`, 0 to 11; no two have the same."""
    turn, colour = divmod(place, len(_LINE_COLOURS))
    return {
        "color": _LINE_COLOURS[colour],
        "marker": _LINE_MARKERS[(colour + 3 * turn) % len(_LINE_MARKERS)],
        "ls": "--" if turn else "-",
        "mfc": "white" if turn else _LINE_COLOURS[colour],
        "ms": 4,
        "lw": 1.2,
    }


def trials_note(trials: Iterable[int], of: str, missing: str = "") -> str:
    """How many trials are behind each point or cell, and what a single one does not give."""
    numbers = sorted(trials)
    least, most = numbers[0], numbers[-1]
    span = f"{least}" if least == most else f"{least} to {most}"
    note = f"{span} trial{'s' * (most > 1)} a {of}"
    return f"{note}; one trial gives no {missing}" if least == 1 and missing else note
