"""Figures of run folders and of sweeps, as PNG, SVG or PDF."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from kilotwin.errors import InputError, cause_of
from kilotwin.plot import style
from kilotwin.plot.map import draw_map
from kilotwin.plot.series import draw_series
from kilotwin.plot.sweep import draw_error, draw_iqr, draw_median, draw_symmetry
from kilotwin.plot.timeline import draw_timeline
from kilotwin.runs.reader import Run
from kilotwin.sweep.conditions import Conditions

RUN_FIGURES: dict[str, Callable[[Run], Figure]] = {"map": draw_map, "timeline": draw_timeline}
SWEEP_FIGURES: dict[str, Callable[[Conditions], Figure]] = {
    "median": draw_median,
    "iqr": draw_iqr,
    "symmetry": draw_symmetry,
    "error": draw_error,
}
SERIES_FIGURE = "series"
_SUFFIXES = {".png", ".svg", ".pdf"}


def write_figure(
    figure: str, folder: Path, target: Path, where: Sequence[str] = (), column: str | None = None
) -> None:
    """Draws a figure of a run's or a sweep's folder; what cannot be done is an InputError.

    `where`: which of the sweep's trials, as for Conditions.open(). `column`: of the series.
    """
    if target.suffix.lower() not in _SUFFIXES:
        raise InputError(f"-o {target}: not a kind of picture; end the name in .png, .svg or .pdf")
    if column is not None and figure != SERIES_FIGURE:
        raise InputError(f"--column {column}: for the figure series; {figure} has none")
    if figure in RUN_FIGURES:
        if where:
            raise InputError(f"--where {where[0]}: for figures of sweeps; {figure} is of one run")
        drawing = partial(RUN_FIGURES[figure], Run.open(folder))
    elif figure == SERIES_FIGURE:
        drawing = partial(draw_series, folder, where, column or "")
    else:
        drawing = partial(SWEEP_FIGURES[figure], Conditions.open(folder, where))
    drawn = style.draw(drawing)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        style.save(drawn, target)
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"-o {target}: cannot be written ({reason}); name another file") from None
