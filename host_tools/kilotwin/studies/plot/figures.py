"""Figures of run folders and of sweeps, as PNG, SVG or PDF."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from kilotwin.errors import InputError, cause_of
from kilotwin.runs.folder import EXPERIMENT
from kilotwin.runs.reader import Run
from kilotwin.studies.plot import style
from kilotwin.studies.plot.effects import draw_ecdf, draw_effect, draw_heat
from kilotwin.studies.plot.map import draw_map
from kilotwin.studies.plot.series import draw_curve, draw_run_curve, draw_series
from kilotwin.studies.plot.sweep import draw_error, draw_iqr, draw_median, draw_symmetry
from kilotwin.studies.plot.timeline import draw_states, draw_timeline
from kilotwin.studies.sweep.conditions import Conditions
from kilotwin.studies.sweep.results import Results

RUN_FIGURES: dict[str, Callable[[Run], Figure]] = {
    "map": draw_map,
    "timeline": draw_timeline,
    "states": draw_states,
}
SWEEP_FIGURES: dict[str, Callable[[Conditions], Figure]] = {
    "median": draw_median,
    "iqr": draw_iqr,
    "symmetry": draw_symmetry,
    "error": draw_error,
}
SERIES_FIGURE = "series"
VIDEO = "video"
_SUFFIXES = {".png", ".svg", ".pdf"}


@dataclass(frozen=True)
class Wanted:
    """The contents wanted of a figure. Keys and metrics by name, None where they were not given.

    `where`: which of the sweep's trials, as for Conditions.open(). `column`: of series.parquet.
    """

    where: Sequence[str] = ()
    column: str | None = None
    metric: str | None = None
    x: str | None = None
    y: str | None = None
    by: str | None = None
    hue: str | None = None
    panels: str | None = None
    statistic: str | None = None


# Figures of metrics: the options that each needs, and may have.
METRIC_FIGURES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "curve": (("metric",), ("by",)),
    "effect": (("x", "y"), ("hue",)),
    "heat": (("x", "y", "metric"), ("panels", "statistic")),
    "ecdf": (("metric",), ("by",)),
}


def write_figure(figure: str, folder: Path, target: Path, wanted: Wanted | None = None) -> None:
    """Draws a figure of a run's or a sweep's folder; what cannot be done is an InputError."""
    wanted = wanted or Wanted()
    if target.suffix.lower() not in _SUFFIXES:
        raise InputError(f"-o {target}: not a kind of picture; end the name in .png, .svg or .pdf")
    check_options(figure, wanted)
    if figure in RUN_FIGURES:
        drawing = partial(RUN_FIGURES[figure], Run.open(folder))
    elif figure == SERIES_FIGURE:
        drawing = partial(draw_series, folder, wanted.where, wanted.column or "")
    elif figure in METRIC_FIGURES:
        drawing = partial(_draw_metric, figure, folder, wanted)
    else:
        drawing = partial(SWEEP_FIGURES[figure], Conditions.open(folder, wanted.where))
    drawn = style.draw(drawing)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        style.save(drawn, target)
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"-o {target}: cannot be written ({reason}); name another file") from None


def check_options(figure: str, wanted: Wanted) -> None:
    """Each option belongs to some figures, and some figures need one."""
    if (figure in RUN_FIGURES or figure == VIDEO) and wanted.where:
        first = wanted.where[0]
        raise InputError(f"--where {first}: for figures of sweeps; {figure} is of one run")
    if wanted.column is not None and figure != SERIES_FIGURE:
        what = f"for the figure series; {figure} has none"
        raise InputError(f"--column {wanted.column}: {what}")
    needed, more = METRIC_FIGURES.get(figure, ((), ()))
    for option in ("metric", "x", "y", "by", "hue", "panels", "statistic"):
        given = getattr(wanted, option)
        if given is not None and option not in (*needed, *more):
            takes = " and ".join(f"--{name}" for name in (*needed, *more)) or "none of these"
            raise InputError(f"--{option} {given}: not for the figure {figure}; it takes {takes}")
        if given is None and option in needed:
            raise InputError(f"{figure}: which one? Add --{option}")


def _draw_metric(figure: str, folder: Path, wanted: Wanted) -> Figure:
    if figure == "curve" and (folder / EXPERIMENT).exists():
        assert wanted.metric is not None
        for option, given in {"by": wanted.by, "where": next(iter(wanted.where), None)}.items():
            if given is not None:
                raise InputError(f"--{option} {given}: for sweeps; {folder} is one run")
        return draw_run_curve(Run.open(folder), wanted.metric)
    results = Results.open(folder, wanted.where)

    def key(option: str) -> str | None:
        name = getattr(wanted, option)
        return None if name is None else results.key(name, f"--{option}")

    if figure == "effect":
        x = key("x")
        assert x is not None
        assert wanted.y is not None
        return draw_effect(results, results.metric(wanted.y, "--y"), x, key("hue"))
    assert wanted.metric is not None
    column = results.metric(wanted.metric)
    if figure == "heat":
        x, y = key("x"), key("y")
        assert x is not None
        assert y is not None
        statistic = wanted.statistic or "median"
        return draw_heat(results, column, x, y, panels=key("panels"), statistic=statistic)
    by = key("by")
    if figure == "ecdf":
        return draw_ecdf(results, column, by)
    return draw_curve(results, column, [by] if by else [])
