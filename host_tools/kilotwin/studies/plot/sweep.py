"""Figures of a sweep: the paper's three (medians, quartile ranges, symmetry), and the error."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from statistics import median

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from kilotwin.errors import InputError
from kilotwin.runs.palette import OUTLINE, name_fill
from kilotwin.studies.compare.bootstrap import bootstrap_mean, spread
from kilotwin.studies.plot.heat_map import SHADES, draw_map, look_of, value_labels
from kilotwin.studies.plot.style import (
    HATCHES,
    MOST_LINES,
    letters,
    line_look,
    repeats,
    trials_note,
    wrapped,
)
from kilotwin.studies.sweep.conditions import Condition, Conditions, Ending, errors, on_site

Split = tuple[tuple[str, ...], tuple[float, ...]]
"""Sites, and the share of the informed robots for each."""
Cells = dict[tuple[float, float], list[int]]
"""By the share informed, and the share of them for a site: the robots on it, trial by trial."""

_LARGEST = 100  # inches: a larger figure is of no use
_COLUMNS = 6  # panels of the error figure side by side

_SINGLE = 40  # robots up to which each number of them has a bar of its own
_BARS = 20


def draw_median(trials: Conditions) -> Figure:
    """Median robots on each site at the end: a heat map per site, controller and N."""
    return _heat_maps(
        trials, lambda robots: float(median(robots)), "median robots resting at the end", 1.0
    )


def draw_iqr(trials: Conditions) -> Figure:
    """Interquartile ranges, laid out as the medians; one trial has none."""
    label = "interquartile range of robots resting at the end"
    return _heat_maps(trials, quartile_range, label, missing="range (\N{EN DASH})")


def draw_symmetry(trials: Conditions) -> Figure:
    """Trials without informed robots: how often how many robots rest on each site."""
    groups: dict[Condition, list[Ending]] = {}
    for condition, endings in trials.where(informed=0.0).items():
        shares_of_nobody = (0.0,) * len(condition.sites)
        groups.setdefault(replace(condition, shares=shares_of_nobody), []).extend(endings)
    if not groups:
        raise InputError(f"{trials.name}: no trial with nobody informed; add informed = 0")
    looks = _site_looks(trials, groups)
    columns = min(len(groups), 2)
    rows = -(-len(groups) // columns)
    legend = _legend_width([str(look.get_label()) for look in looks.values()])
    size = (5.6 * columns, 3.6 * rows)
    figure = _figure(trials, size, "nobody informed", legend=legend)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, (condition, endings) in zip(panels, groups.items(), strict=False):
        _draw_frequencies(axes, condition, endings, looks)
    for axes in panels[len(groups) :]:
        axes.set_axis_off()
    tallest = max(axes.get_ylim()[1] for axes in panels[: len(groups)])
    for axes in panels[: len(groups)]:
        axes.set_ylim(0, tallest)
    figure.legend(handles=list(looks.values()), loc="outside right upper", fontsize=9)
    return figure


def draw_error(trials: Conditions) -> Figure:
    """Robots too many or too few per site: means with 95 % bootstrap intervals, by controller."""
    informed = _informed(trials)
    rules = [rule for rule in trials.rules if any(rule == c.rule for c in informed)]
    if len(rules) > MOST_LINES:
        raise InputError(
            f"{trials.name}: {len(rules)} controllers, and one figure can tell {MOST_LINES} apart; "
            f"choose one, as by --where rule={rules[0]}"
        )
    panels = error_panels(informed)
    labels = value_labels(share for c in informed for share in c.shares)
    rows, columns = (1 + max(place) for place in zip(*panels, strict=True))
    names = [_legend_text(rule) for rule in rules]
    figure = _figure(
        trials,
        (2.5 * columns + 1.2, 2.6 * rows + 0.6),
        "error to the target, mean and 95 % interval",
        trials_note(map(len, informed.values()), "point", "interval"),
        _legend_width(names),
    )
    grid = figure.add_gridspec(rows, columns)
    first: Axes | None = None
    of_size: dict[int, Axes] = {}
    for (row, column), (size, split) in panels.items():
        axes = figure.add_subplot(grid[row, column], sharex=first, sharey=of_size.get(size))
        first = first or axes
        of_size.setdefault(size, axes)
        cells = {
            c: e for c, e in informed.items() if (c.robots, (c.sites, c.shares)) == (size, split)
        }
        _draw_errors(axes, cells, rules)
        # The spaces within a pair do not break.
        wanted = ", ".join(
            f"{name}\N{NO-BREAK SPACE}{labels[share]}" for name, share in zip(*split, strict=True)
        )
        axes.set_title(wrapped(f"wanted: {wanted}", 2.5, 9), fontsize=9)
        is_left, is_lowest = (row, column - 1) not in panels, (row + 1, column) not in panels
        axes.tick_params(labelleft=is_left, labelbottom=is_lowest)
        if is_left:
            axes.set_ylabel(f"N = {size}\nerror (robots per site)")
        if is_lowest:
            axes.set_xlabel("share informed")
    for axes in of_size.values():
        axes.set_ylim(bottom=0)
    lines = [Line2D([], [], **line_look(place)) for place in range(len(rules))]
    figure.legend(lines, names, loc="outside right upper", fontsize=9)
    return figure


def quartile_range(robots: Sequence[int]) -> float:
    """The interquartile range; NaN of one trial."""
    return spread(robots) if len(robots) > 1 else math.nan


def error_panels(conditions: Iterable[Condition]) -> dict[tuple[int, int], tuple[int, Split]]:
    """Which N and split stands in which row and column, from 0: only those that have trials.

    Six splits or fewer have a column each. More of them go on in the next row, each N's by itself.
    """
    held = sorted({(c.robots, (c.sites, c.shares)) for c in conditions})
    splits = sorted({split for _, split in held})
    panels: dict[tuple[int, int], tuple[int, Split]] = {}
    top = 0
    for size in sorted({size for size, _ in held}):
        own = [split for robots, split in held if robots == size]
        order = splits if len(splits) <= _COLUMNS else own
        for split in own:
            row, column = divmod(order.index(split), _COLUMNS)
            panels[top + row, column] = (size, split)
        top += -(-len(own) // _COLUMNS)
    return panels


def bar_edges(robots: int) -> list[int]:
    """The first number of robots of each bar, and the one after the last bar.

    Up to 40 robots a bar is one number; of more there are 20 bars or a few less, as wide as one
    another but for the last. Where that would be N alone, N joins the bar before: of 100 robots
    the paper's 20 bars.
    """
    width = 1 if robots <= _SINGLE else -(-robots // _BARS)
    edges = [*range(0, robots + 1, width), robots + 1]
    if width > 1 and robots % width == 0:
        del edges[-2]
    return edges


def site_cells(
    endings: Mapping[Condition, Sequence[Ending]],
    size: int,
    rule: str,
    sites: tuple[str, ...],
    site: str,
) -> Cells:
    """The trials of each cell of the heat map of one of `sites`.

    Conditions that differ in the other sites' shares only are one cell here.
    """
    cells: Cells = {}
    index = sites.index(site)
    for condition, ended in endings.items():
        if (condition.robots, condition.rule, condition.sites) == (size, rule, sites):
            cell = (condition.informed, condition.shares[index])
            cells.setdefault(cell, []).extend(on_site(ended, index))
    return cells


def _informed(trials: Conditions) -> dict[Condition, list[Ending]]:
    found = {c: endings for c, endings in trials.where().items() if c.informed > 0}
    if not found:
        raise InputError(f"{trials.name}: no trial with informed robots; vary swarm.informed")
    return found


def _figure(
    trials: Conditions, size: tuple[float, float], shows: str, note: str = "", legend: float = 0.0
) -> Figure:
    """An empty figure of so many inches, titled, with a small line below.

    That says, too, where trials of the sweep are lacking.

    `legend`: the width of a room to the right of all that.
    """
    heading = wrapped(f"{trials.name}: {shows}", size[0], 13.2)
    note = "; ".join(filter(None, (note, trials.progress)))
    width, height = size[0] + legend, size[1] + 0.22 * heading.count("\n")
    if max(width, height) > _LARGEST:
        raise InputError(
            f"{trials.name}: the picture would be {width:.0f} by {height:.0f} inches, and "
            f"{_LARGEST} is the most; choose some trials, as by --where rule={trials.rules[0]}"
        )
    figure = Figure(figsize=(width, height))
    figure.set_layout_engine("constrained")
    figure.suptitle(heading, x=0.01, ha="left")
    figure.supxlabel(wrapped(note, size[0], 9), x=0.01, ha="left", fontsize=9)
    return figure


def _legend_text(name: str) -> str:
    return wrapped(name, 2, 9)


def _legend_width(labels: Sequence[str]) -> float:
    lines = [line for label in labels for line in label.split("\n")]
    return 0.6 + letters(max(map(len, lines)), 9)


def _heat_maps(
    trials: Conditions,
    statistic: Callable[[Sequence[int]], float],
    label: str,
    top: float | None = None,
    missing: str = "",
) -> Figure:
    """White is 0, black `top` times N, or the widest value; the same scale in all maps of one N."""
    informed = _informed(trials)
    sizes = sorted({condition.robots for condition in informed})
    columns = _map_columns(trials, informed)
    found = {
        (row, column): site_cells(informed, size, *columns[column])
        for row, size in enumerate(sizes)
        for column in range(len(columns))
    }
    maps = {place: cells for place, cells in found.items() if cells}
    values = {
        place: {cell: statistic(robots) for cell, robots in cells.items()}
        for place, cells in maps.items()
    }
    if top is None:
        widths = [v / sizes[row] for (row, _), of in values.items() for v in of.values()]
        top = max([0.05, *(width for width in widths if not math.isnan(width))])
    look = look_of(list(values.values()))
    heads, feet, more = _map_texts(columns, sizes, look.width)
    width = look.width * len(columns) + 1
    height = (look.height + 0.18 * more) * len(sizes) + 0.6
    figure = _figure(trials, (width, height), label, _cells_note(list(maps.values()), missing))
    grid = figure.add_gridspec(len(sizes), len(columns))
    for row, size in enumerate(sizes):
        drawn: dict[int, Axes] = {}
        for column in range(len(columns)):
            if (row, column) in maps:
                axes = drawn[column] = figure.add_subplot(grid[row, column])
                draw_map(axes, values[row, column], look, top * size)
                axes.set_title(heads[row, column], fontsize=10)
                axes.set_xlabel(feet[column])
        drawn[min(drawn)].set_ylabel("share informed")
        shades = ScalarMappable(Normalize(0, top * size), SHADES)
        bar = figure.colorbar(shades, ax=list(drawn.values()), shrink=0.9, fraction=0.7 / width)
        bar.set_label("robots")
    return figure


_Column = tuple[str, tuple[str, ...], str]
"""A column of heat maps: the rule, the sites, and which of them it is about."""


def _map_columns(trials: Conditions, informed: Iterable[Condition]) -> list[_Column]:
    arenas = sorted(
        {condition.sites for condition in informed}, key=lambda sites: (len(sites), sites)
    )
    held = {(condition.rule, condition.sites) for condition in informed}
    return [
        (rule, sites, site)
        for rule in trials.rules
        for sites in arenas
        if (rule, sites) in held
        for site in sites
    ]


def _map_texts(
    columns: Sequence[_Column], sizes: Sequence[int], width: float
) -> tuple[dict[tuple[int, int], str], list[str], int]:
    """Above each map, below each column, and how many lines these have more than usual."""
    is_mixed = len({sites for _, sites, _ in columns}) > 1
    heads = {}
    for column, (rule, sites, site) in enumerate(columns):
        among = wrapped(f"site {site}" + f" of {len(sites)}" * is_mixed, width - 0.4, 10)
        for row, size in enumerate(sizes):
            heads[row, column] = wrapped(f"{rule}, N = {size}", width - 0.4, 10) + f"\n{among}"
    feet = [wrapped(f"share of informed for {site}", width) for _, _, site in columns]
    more = max(head.count("\n") for head in heads.values()) - 1
    return heads, feet, more + max(foot.count("\n") for foot in feet)


def _cells_note(maps: Sequence[Cells], missing: str) -> str:
    note = trials_note((len(of) for cells in maps for of in cells.values()), "cell", missing)
    without = sum(
        len({up for up, _ in cells}) * len({across for _, across in cells}) - len(cells)
        for cells in maps
    )
    if without:
        note += f"; {without} cell{'s' * (without > 1)} without trials (pale blue)"
    return note


def _site_looks(trials: Conditions, groups: Iterable[Condition]) -> dict[str, Patch]:
    """Look of each site, as the legend shows it."""
    names = [name for name in trials.sites if any(name in group.sites for group in groups)]
    fills = [name_fill(name, trials.sites.index(name)) for name in names]
    return {
        name: Patch(
            facecolor=fill, hatch=hatch, edgecolor=OUTLINE, label=_legend_text(f"site {name}")
        )
        for name, fill, hatch in zip(names, fills, repeats(fills, HATCHES), strict=True)
    }


def _draw_frequencies(
    axes: Axes, condition: Condition, endings: list[Ending], looks: Mapping[str, Patch]
) -> None:
    edges = bar_edges(condition.robots)
    starts = np.array(edges[:-1])
    bar = edges[1] - edges[0]
    # A number by itself stands over its tick; the bar of several begins at the first of them.
    left, right = (-0.5, edges[-1] - 0.5) if bar == 1 else (0, edges[-2] + bar)
    sites = len(condition.shares)
    width = bar / (sites + 0.5)
    for site, name in enumerate(condition.sites):
        counts, _ = np.histogram(on_site(endings, site), edges)
        look = looks[name]
        axes.bar(
            starts + left + (site + 0.75) * width,
            counts,
            width,
            color=look.get_facecolor(),
            hatch=look.get_hatch(),
            edgecolor=OUTLINE,
            lw=0.8 if len(starts) * sites <= 60 else 0.3,
        )
    one = sum(ending.is_one_aggregate for ending in endings)
    axes.set_facecolor("#e4e4e4")
    heading = f"{condition.rule}, N = {condition.robots}: one aggregate in {one} of {len(endings)}"
    axes.set_title(wrapped(heading, 5, 10), fontsize=10)
    resting = "robots resting on the site at the end"
    if bar > 1:
        resting += f"\nin bars of {bar}; the last: {edges[-2]} to {edges[-1] - 1}"
    axes.set(xlabel=resting, ylabel="trials", xlim=(left, right))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(integer=True))


def _draw_errors(axes: Axes, cells: Mapping[Condition, list[Ending]], rules: Sequence[str]) -> None:
    shares = sorted({condition.informed for condition in cells})
    nearest = min((b - a for a, b in pairwise(shares)), default=1.0)
    for place, rule in enumerate(rules):
        own = {condition: endings for condition, endings in cells.items() if condition.rule == rule}
        if own:
            shift = min(0.012, 0.6 * nearest / len(rules)) * (place - (len(rules) - 1) / 2)
            points = [
                bootstrap_mean(errors(condition, endings)) for condition, endings in own.items()
            ]
            values = np.array([point.value for point in points])
            low = values - [point.low for point in points]
            high = np.array([point.high for point in points]) - values
            axes.errorbar(
                [condition.informed + shift for condition in own],
                values,
                yerr=np.maximum([low, high], 0),
                capsize=2,
                **line_look(place),
            )
    axes.grid(color="#dddddd", lw=0.6)
