"""Anything that was measured in a run, or in the trials of a sweep: over time, and at the end.

Trials that are drawn together give medians over time, with the range from the lower to the upper
quartile, and each trial's value at the end.
"""

from collections.abc import Sequence
from pathlib import Path
from statistics import median

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from kilotwin.errors import InputError
from kilotwin.runs.reader import Run
from kilotwin.studies.plot.style import (
    MOST_LINES,
    letters,
    line_look,
    title,
    trials_note,
    wrapped,
)
from kilotwin.studies.sweep.results import (
    Column,
    Results,
    Series,
    find_column,
    shown,
    values_of,
)

Lines = dict[str, list[Series]]


def draw_series(folder: Path, where: Sequence[str], column: str) -> Figure:
    """Curves by all that varied among the chosen trials, or by their names where these do."""
    results = Results.open(folder, where)
    if not column:
        there = ", ".join(one.column for one in results.metrics)
        raise InputError(f"which column? Add --column; {folder} has {there}")
    by = ["name"] if "name" in results.varied else results.varied
    return draw_curve(results, results.metric(column, "--column"), by)


def draw_run_curve(run: Run, name: str) -> Figure:
    """A metric of one run over time; the quartiles of robots, where each one's was recorded."""
    samples = run.sites()
    column = find_column(samples, name, "--metric", run.folder)
    time_s, values = values_of(samples, column)
    known = np.isfinite(values)
    if not known.any():
        raise InputError(
            f"{run.folder}: {column.name} has no value in any sample; see events.jsonl, or let "
            "the run go on for longer"
        )
    figure = Figure(figsize=(10, 4.8))
    figure.set_layout_engine("constrained")
    axes = figure.subplots()
    look = line_look(0)
    axes.plot(time_s[known], values[known], color=look["color"], label=column.name)
    if column.column in run.robots().column_names:
        _draw_quartiles(axes, run, column)
        axes.legend(fontsize=9, loc="best")
    axes.set(ylabel=wrapped(column.label, 4))
    axes.set_title(wrapped(f"{title(run)}: {column.name}", 9, 12))
    _over_time(axes)
    _count_from_zero(axes, column)
    return figure


def _draw_quartiles(axes: Axes, run: Run, column: Column) -> None:
    """Draws median and quartiles of the robots that have a value, at each sample."""
    time_s, values = values_of(run.robots(), column)
    known = np.isfinite(values)
    moments, places = np.unique(time_s[known], return_inverse=True)
    of_moment = np.split(
        values[known][np.argsort(places, kind="stable")],
        np.cumsum(np.bincount(places, minlength=len(moments)))[:-1],
    )
    quartiles = np.array([np.percentile(one, [25, 75]) for one in of_moment]).reshape(-1, 2)
    look = line_look(0)
    axes.fill_between(
        moments, *quartiles.T, color=look["color"], alpha=0.2, lw=0, label="robots, quartiles"
    )


def draw_curve(results: Results, column: Column, by: Sequence[str]) -> Figure:
    """Curves of a metric, one for each combination of values of the keys `by`."""
    groups = results.groups(by)
    if len(groups) > MOST_LINES:
        raise InputError(
            f"{results.folder}: {len(groups)} kinds of trials, and one figure can tell "
            f"{MOST_LINES} apart; choose some, as by --where {by[0]}={next(iter(groups))[0]}"
        )
    lines = {
        _label(by, values): [results.over_time(row["trial"], column) for row in rows]
        for values, rows in groups.items()
    }
    width = 10 + letters(max(map(len, lines)), 9)
    figure = Figure(figsize=(min(width, 16), 4.8))
    figure.set_layout_engine("constrained")
    figure.suptitle(wrapped(f"{results.name}: {column.name}", 9, 13.2), x=0.01, ha="left")
    note = trials_note(map(len, groups.values()), "curve", "range")
    note = "; ".join(filter(None, (note, results.pooled(by))))
    figure.supxlabel(wrapped(note, 9, 9), x=0.01, ha="left", fontsize=9)
    over_time, at_the_end = figure.subplots(1, 2, width_ratios=[3, 2])
    _draw_over_time(over_time, lines, column)
    _draw_at_the_end(at_the_end, lines, column)
    for axes in (over_time, at_the_end):
        _count_from_zero(axes, column)
    return figure


def _label(by: Sequence[str], values: tuple[object, ...]) -> str:
    said = [
        shown(value) if key == "name" else f"{key} {shown(value)}"
        for key, value in zip(by, values, strict=True)
    ]
    return ", ".join(said) or "all trials"


def _draw_over_time(axes: Axes, lines: Lines, column: Column) -> None:
    for place, (label, trials) in enumerate(lines.items()):
        # Trials that an interruption cut short end earlier.
        shortest = min(len(time_s) for time_s, _ in trials)
        time_s = trials[0][0][:shortest]
        values = np.stack([value[:shortest] for _, value in trials])
        known = np.isfinite(values).all(axis=0)
        time_s, values = time_s[known], values[:, known]
        look = line_look(place)
        middle = np.median(values, axis=0)
        axes.plot(time_s, middle, color=look["color"], ls=look["ls"], label=label)
        if len(trials) > 1 and len(time_s):
            low, high = np.percentile(values, [25, 75], axis=0)
            axes.fill_between(time_s, low, high, color=look["color"], alpha=0.2, lw=0)
    axes.set(ylabel=wrapped(f"{column.label}, median and quartiles", 4))
    axes.legend(fontsize=9, loc="best")
    _over_time(axes)


def _over_time(axes: Axes) -> None:
    axes.set(xlabel="time (s)")
    axes.set_xlim(left=0)
    axes.xaxis.set_major_formatter(lambda second, _: f"{second:,.10g}")
    axes.grid(color="#dddddd", lw=0.6)


def _draw_at_the_end(axes: Axes, lines: Lines, column: Column) -> None:
    for place, trials in enumerate(lines.values()):
        look = line_look(place)
        last = [float(value[-1]) for _, value in trials if len(value) and np.isfinite(value[-1])]
        if not last:
            continue
        shift = np.linspace(-0.15, 0.15, len(last)) if len(last) > 1 else np.zeros(1)
        axes.plot(place + shift, last, ls="", marker=look["marker"], ms=4, color=look["color"])
        axes.hlines(median(last), place - 0.3, place + 0.3, color=look["color"], lw=2)
    labels = [wrapped(label, 0.8, 9) for label in lines]
    axes.set_xticks(range(len(lines)), labels, fontsize=9)
    axes.set(ylabel=wrapped(f"{column.label} at the end, each trial and median", 4))
    axes.grid(axis="y", color="#dddddd", lw=0.6)


def _count_from_zero(axes: Axes, column: Column) -> None:
    """Counts and shares from 0 on; counts in whole numbers."""
    if axes.get_ylim()[0] > -1e-9 or column.unit in ("robots", "share"):
        axes.set_ylim(bottom=0)
    if column.unit in ("robots", ""):
        axes.yaxis.set_major_locator(MaxNLocator(integer=column.unit == "robots"))
