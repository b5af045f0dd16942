"""Last values of a sweep's trials by the values of keys: points, a heat map, shares."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from statistics import median
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from kilotwin.errors import InputError
from kilotwin.studies.compare.bootstrap import bootstrap_mean, spread
from kilotwin.studies.plot.heat_map import SHADES, draw_map, look_of
from kilotwin.studies.plot.style import MOST_LINES, letters, line_look, trials_note, wrapped
from kilotwin.studies.sweep.results import Column, Results, shown

_SIZE = (7.5, 4.8)

Groups = dict[tuple[Any, ...], NDArray[np.float64]]


def draw_effect(results: Results, column: Column, x: str, hue: str | None) -> Figure:
    """Means with 95 % bootstrap intervals over the values of a key, and each trial as a point."""
    lines = _lines(results, column, [x], hue)
    figure, axes = _figure(
        results, column, f"by {x}", lines, of="point", keys=[x, hue], missing="interval"
    )
    values = list(results.groups([x]))
    places, is_scale = _places([value for (value,) in values])
    nearest = min((b - a for a, b in pairwise(sorted(places.values()))), default=1.0)
    for line, (label, groups) in enumerate(lines.items()):
        shift = min(0.08, 0.5 / len(lines)) * nearest * (line - (len(lines) - 1) / 2)
        _draw_points(
            axes, [(places[key] + shift, of) for (key,), of in groups.items()], line, label
        )
    if not is_scale:
        texts = [wrapped(shown(value), 0.9, 9) for value in places]
        axes.set_xticks(list(places.values()), texts, fontsize=9)
    axes.set(xlabel=x, ylabel=wrapped(f"{column.label} at the end, mean and 95 % interval", 4))
    _finish(figure, axes, hue)
    return figure


def draw_ecdf(results: Results, column: Column, by: str | None) -> Figure:
    """The share of trials that ended with so much at most."""
    lines = _lines(results, column, [], by)
    figure, axes = _figure(results, column, "distribution over trials", lines, of="line", keys=[by])
    for place, (label, groups) in enumerate(lines.items()):
        for values in groups.values():
            look = line_look(place)
            axes.ecdf(values, color=look["color"], ls=look["ls"], lw=1.6, label=label)
    axes.set(xlabel=f"{column.label} at the end", ylabel="share of trials with so much at most")
    _finish(figure, axes, by)
    return figure


def draw_heat(
    results: Results,
    column: Column,
    x: str,
    y: str,
    *,
    panels: str | None = None,
    statistic: str = "median",
) -> Figure:
    """Medians at the end, or another of STATISTICS: a cell for each pair of values of two keys.

    `panels`: a map for each value of a third key, of trials that set the other two.
    """
    maps = _maps(results, column, x, y, panels)
    of_cells = {
        name: {pair: STATISTICS[statistic](ended.tolist()) for pair, ended in cells.items()}
        for name, cells in maps.items()
    }
    look = look_of(list(of_cells.values()))
    columns = min(len(maps), 2)
    rows_of = -(-len(maps) // columns)
    wide = columns * look.width
    figure = Figure(figsize=(wide + 1.8, rows_of * (look.height + 0.3 * bool(panels)) + 0.8))
    figure.set_layout_engine("constrained")
    heading = f"{results.name}: {column.name} at the end, {_STATISTIC_NAMES[statistic]}"
    figure.suptitle(wrapped(heading, wide + 1.6, 13.2), x=0.01, ha="left")
    sizes = [len(ended) for cells in maps.values() for ended in cells.values()]
    missing = "range (\N{EN DASH})" if statistic == "iqr" else ""
    notes = [
        trials_note(sizes, "cell", missing),
        results.pooled([key for key in (x, y, panels) if key]),
    ]
    note = wrapped("; ".join(filter(None, notes)), wide + 1.6, 9)
    figure.supxlabel(note, x=0.01, ha="left", fontsize=9)
    bottom, top = _range_of(column, of_cells)
    all_axes = figure.subplots(rows_of, columns, squeeze=False).ravel()
    for axes, (name, cells_of) in zip(all_axes, of_cells.items(), strict=False):
        draw_map(axes, cells_of, look, top, bottom)
        axes.set(xlabel=x, ylabel=y)
        if panels:
            axes.set_title(wrapped(name, look.width, 10), fontsize=10)
    for axes in all_axes[len(maps) :]:
        axes.set_axis_off()
    bar = figure.colorbar(ScalarMappable(Normalize(bottom, top), SHADES), ax=list(all_axes))
    bar.set_label(column.label)
    return figure


def _maps(
    results: Results, column: Column, x: str, y: str, panels: str | None
) -> dict[str, Groups]:
    """Values at the end by panel, then by the values of y and x."""
    maps: dict[str, Groups] = {}
    for values, rows in results.groups([*([panels] if panels else []), y, x]).items():
        pair = values[-2:]
        ended = results.at_end(rows, column)
        if len(ended) and not (panels and None in pair):
            maps.setdefault(shown(values[0]) if panels else "", {})[pair] = ended
    if not maps:
        raise _nothing(results, column)
    if len(maps) > _MOST_PANELS:
        what = f"{len(maps)} values of {panels}, and one figure has room for {_MOST_PANELS}"
        raise InputError(f"{results.folder}: {what}; choose some by --where")
    return maps


def _range_of(
    column: Column, of_cells: dict[str, dict[tuple[Any, ...], float]]
) -> tuple[float, float]:
    """Values that are white and black: the same in all maps of a figure."""
    if column.unit == "share":
        return 0.0, 1.0
    values = [value for cells in of_cells.values() for value in cells.values()]
    known = [value for value in values if not math.isnan(value)] or [0.0]
    bottom, top = min(0.0, *known), max(known)
    return bottom, top if top > bottom else bottom + 1


def _quartile_range(values: Sequence[float]) -> float:
    """NaN of one trial."""
    return spread(values) if len(values) > 1 else math.nan


STATISTICS: dict[str, Callable[[Sequence[float]], float]] = {
    "median": lambda values: float(median(values)),
    "iqr": _quartile_range,
    "mean": lambda values: float(np.mean(values)),
}
"""Statistics of its trials that a cell of a heat map may show."""
_STATISTIC_NAMES = {"median": "median", "iqr": "interquartile range", "mean": "mean"}
_MOST_PANELS = 12


def _lines(
    results: Results, column: Column, keys: Sequence[str], hue: str | None
) -> dict[str, Groups]:
    """Values at the end by line, then by the values of keys; without groups that have none."""
    lines: dict[str, Groups] = {}
    for values, rows in results.groups([*([hue] if hue else []), *keys]).items():
        ended = results.at_end(rows, column)
        if len(ended):
            label = f"{hue} {shown(values[0])}" if hue else "all trials"
            lines.setdefault(label, {})[values[1:] if hue else values] = ended
    if not lines:
        raise _nothing(results, column)
    if len(lines) > MOST_LINES:
        raise InputError(
            f"{results.folder}: {len(lines)} values of {hue}, and one figure can tell {MOST_LINES} "
            f"apart; choose some, as by --where {hue}={next(iter(lines)).removeprefix(f'{hue} ')}"
        )
    return lines


def _nothing(results: Results, column: Column) -> InputError:
    return InputError(
        f"{results.folder}: no trial ended with a value of {column.name}; draw its curve, or see "
        "why in metrics_failed of trials.parquet"
    )


def _figure(
    results: Results,
    column: Column,
    shows: str,
    lines: dict[str, Groups],
    *,
    of: str,
    keys: Sequence[str | None],
    missing: str = "",
) -> tuple[Figure, Axes]:
    room = 0.6 + letters(max(map(len, lines)), 9) if len(lines) > 1 else 0.0
    figure = Figure(figsize=(_SIZE[0] + room, _SIZE[1]))
    figure.set_layout_engine("constrained")
    heading = f"{results.name}: {column.name}, {shows}"
    figure.suptitle(wrapped(heading, _SIZE[0], 13.2), x=0.01, ha="left")
    sizes = [len(values) for groups in lines.values() for values in groups.values()]
    notes = [trials_note(sizes, of, missing), results.pooled([key for key in keys if key])]
    note = wrapped("; ".join(filter(None, notes)), _SIZE[0], 9)
    figure.supxlabel(note, x=0.01, ha="left", fontsize=9)
    return figure, figure.add_subplot()


def _places(values: Sequence[Any]) -> tuple[dict[Any, float], bool]:
    """Where values stand on the axis: numbers as they are, others side by side."""
    is_scale = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
    if is_scale:
        return {value: float(value) for value in values}, True
    return {value: float(place) for place, value in enumerate(values)}, False


def _draw_points(
    axes: Axes, points: Sequence[tuple[float, NDArray[np.float64]]], line: int, label: str
) -> None:
    look = line_look(line)
    found = [bootstrap_mean(values.tolist()) for _, values in points]
    means = np.array([one.value for one in found])
    low = np.nan_to_num(means - [one.low for one in found])
    high = np.nan_to_num([one.high for one in found] - means)
    for at, values in points:
        axes.plot(
            [at] * len(values), values, ls="", marker=".", ms=3, color=look["color"], alpha=0.3
        )
    places = [at for at, _ in points]
    axes.errorbar(places, means, yerr=np.maximum([low, high], 0), capsize=3, label=label, **look)


def _finish(figure: Figure, axes: Axes, hue: str | None) -> None:
    axes.grid(color="#dddddd", lw=0.6)
    if hue:
        figure.legend(loc="outside right upper", fontsize=9)
