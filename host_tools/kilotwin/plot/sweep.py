"""Figures of a sweep: the paper's three (medians, quartile ranges, symmetry), and the error."""

from collections.abc import Callable, Sequence
from statistics import median
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from kilotwin.colours import SITE_COLOURS, SITE_PALETTE
from kilotwin.errors import InputError
from kilotwin.intervals import bootstrap_mean, spread
from kilotwin.plot.style import OUTLINE
from kilotwin.sweep.conditions import Condition, Conditions, Ending, errors, on_site

_RULE_COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"]
_RULE_MARKERS = ["o", "s", "^", "D"]
_BINS = 20
_SHADES = "gray_r"  # white is 0


def draw_median(trials: Conditions) -> Figure:
    """Median robots on each site at the end: a heat map per site, controller and N."""
    return _heat_maps(
        trials, lambda robots: float(median(robots)), "median robots resting at the end", 1.0
    )


def draw_iqr(trials: Conditions) -> Figure:
    """Interquartile ranges, laid out as the medians."""
    widest = max(
        (
            spread(on_site(endings, site)) / condition.robots
            for condition, endings in _informed(trials).items()
            for site in range(len(condition.shares))
        ),
        default=0.0,
    )
    label = "interquartile range of robots resting at the end"
    return _heat_maps(trials, spread, label, max(widest, 0.05))


def draw_symmetry(trials: Conditions) -> Figure:
    """Nobody informed: how often how many robots rest on each site."""
    groups = trials.where(informed=0.0)
    if not groups:
        raise InputError(f"{trials.name}: no trial with nobody informed; add informed = 0")
    figure = Figure(figsize=(5.6 * min(len(groups), 2), 3.6 * ((len(groups) + 1) // 2)))
    figure.set_layout_engine("constrained")
    columns = min(len(groups), 2)
    panels = figure.subplots((len(groups) + 1) // 2, columns, squeeze=False).ravel()
    for axes, (condition, endings) in zip(panels, groups.items(), strict=False):
        _draw_frequencies(axes, condition, endings)
    for axes in panels[len(groups) :]:
        axes.set_axis_off()
    tallest = max(axes.get_ylim()[1] for axes in panels[: len(groups)])
    for axes in panels[: len(groups)]:
        axes.set_ylim(0, tallest)
    figure.suptitle(f"{trials.name}: nobody informed", x=0.01, ha="left")
    return figure


def draw_error(trials: Conditions) -> Figure:
    """Robots too many or too few per site: means with 95 % bootstrap intervals, by controller."""
    informed = _informed(trials)
    sizes = sorted({condition.robots for condition in informed})
    splits = sorted({(condition.sites, condition.shares) for condition in informed})
    columns = min(len(splits), 6)
    rows_per_size = -(-len(splits) // columns)
    figure = Figure(figsize=(2.5 * columns + 1.2, 2.6 * len(sizes) * rows_per_size + 0.6))
    figure.set_layout_engine("constrained")
    grid = figure.subplots(
        len(sizes) * rows_per_size, columns, squeeze=False, sharex=True, sharey="row"
    )
    for row, size in enumerate(sizes):
        for place, split in enumerate(splits):
            axes = grid[row * rows_per_size + place // columns, place % columns]
            _draw_errors(axes, trials, size, *split)
            if place % columns == 0:
                axes.set_ylabel(f"N = {size}\nerror (robots per site)")
    for axes in grid.ravel():
        axes.set_ylim(bottom=0)
    for axes in grid[-1]:
        axes.set_xlabel("share informed")
    shown = [axes.get_legend_handles_labels() for axes in grid.ravel()]
    by_rule = {
        rule: line for lines, rules in shown for line, rule in zip(lines, rules, strict=True)
    }
    grid[0, 0].legend(by_rule.values(), by_rule.keys(), fontsize=9)
    figure.suptitle(
        f"{trials.name}: error to the target, mean and 95 % interval", x=0.01, ha="left"
    )
    return figure


def _informed(trials: Conditions) -> dict[Condition, list[Ending]]:
    found = {c: endings for c, endings in trials.where().items() if c.informed > 0}
    if not found:
        raise InputError(f"{trials.name}: no trial with informed robots; vary swarm.informed")
    return found


def _heat_maps(
    trials: Conditions, statistic: Callable[[Sequence[int]], float], label: str, top: float
) -> Figure:
    """White is 0, black `top` times N; the same scale in all maps of one N."""
    informed = _informed(trials)
    sizes = sorted({condition.robots for condition in informed})
    arenas = sorted(
        {condition.sites for condition in informed}, key=lambda sites: (len(sites), sites)
    )
    held = {(condition.rule, condition.sites) for condition in informed}
    columns = [
        (rule, sites, site)
        for rule in trials.rules
        for sites in arenas
        if (rule, sites) in held
        for site in sites
    ]
    figure = Figure(figsize=(2.9 * len(columns) + 1, 2.9 * len(sizes) + 0.5))
    figure.set_layout_engine("constrained")
    grid = figure.subplots(len(sizes), len(columns), squeeze=False)
    for row, size in enumerate(sizes):
        for column, (rule, sites, site) in enumerate(columns):
            cells = {
                c: e
                for c, e in informed.items()
                if (c.robots, c.rule, c.sites) == (size, rule, sites)
            }
            axes = grid[row, column]
            if not cells:
                axes.set_axis_off()
                continue
            _draw_map(axes, cells, site, statistic, top * size)
            among = f" of {len(sites)}" if len(arenas) > 1 else ""
            axes.set_title(f"{rule}, N = {size}\nsite {site}{among}", fontsize=10)
            axes.set_xlabel(f"share of informed for {site}")
            if column == 0:
                axes.set_ylabel("share informed")
        shades = ScalarMappable(Normalize(0, top * size), _SHADES)
        figure.colorbar(shades, ax=list(grid[row]), label="robots", shrink=0.9)
    figure.suptitle(f"{trials.name}: {label}", x=0.01, ha="left")
    return figure


def _draw_map(
    axes: Axes,
    cells: dict[Condition, list[Ending]],
    site: str,
    statistic: Callable[[Sequence[int]], float],
    top: float,
) -> None:
    """Cells that differ in the other sites' shares only are one cell here."""
    pooled: dict[tuple[float, float], list[int]] = {}
    for condition, endings in cells.items():
        index = condition.sites.index(site)
        cell = (condition.informed, condition.shares[index])
        pooled.setdefault(cell, []).extend(on_site(endings, index))
    up = sorted({informed for informed, _ in pooled})
    across = sorted({share for _, share in pooled})
    values: NDArray[np.float64] = np.full((len(up), len(across)), np.nan)
    for (informed, share), robots in pooled.items():
        values[up.index(informed), across.index(share)] = statistic(robots)
    axes.imshow(
        np.ma.masked_invalid(values), origin="lower", cmap=_SHADES, vmin=0, vmax=top, aspect="auto"
    )
    axes.set_facecolor("#cfe3f2")  # a cell without trials
    for (y, x), value in np.ndenumerate(values):
        if not np.isnan(value):
            colour = "white" if value > 0.5 * top else "black"
            axes.text(x, y, f"{value:g}", ha="center", va="center", fontsize=8, color=colour)
    axes.set_xticks(range(len(across)), [f"{share:g}" for share in across])
    axes.set_yticks(range(len(up)), [f"{informed:g}" for informed in up])
    axes.spines[["top", "right"]].set_visible(True)


def _draw_frequencies(axes: Axes, condition: Condition, endings: list[Ending]) -> None:
    edges = np.linspace(0, condition.robots, _BINS + 1)
    sites = len(condition.shares)
    width = (edges[1] - edges[0]) / (sites + 0.5)
    for site in range(sites):
        counts, _ = np.histogram(on_site(endings, site), edges)
        name = condition.sites[site]
        axes.bar(
            edges[:-1] + (site + 0.75) * width,
            counts,
            width,
            color=SITE_COLOURS.get(name, SITE_PALETTE[site % len(SITE_PALETTE)]),
            edgecolor=OUTLINE,
            lw=0.8,
            label=f"site {name}",
        )
    one = sum(ending.is_one_aggregate for ending in endings)
    axes.set_facecolor("#e4e4e4")
    axes.set_title(
        f"{condition.rule}, N = {condition.robots}: one aggregate in {one} of {len(endings)}",
        fontsize=10,
    )
    axes.set(xlabel="robots resting on the site at the end", ylabel="trials")
    axes.set_xlim(0, condition.robots)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(fontsize=9)


def _draw_errors(
    axes: Axes, trials: Conditions, size: int, sites: tuple[str, ...], shares: tuple[float, ...]
) -> None:
    rules = trials.rules
    for place, rule in enumerate(rules):
        cells = {
            condition: endings
            for condition, endings in trials.where(
                rule=rule, robots=size, sites=sites, shares=shares
            ).items()
            if condition.informed > 0
        }
        if not cells:
            continue
        points = [
            bootstrap_mean(errors(condition, endings)) for condition, endings in cells.items()
        ]
        values = np.array([point.value for point in points])
        low = values - [point.low for point in points]
        high = np.array([point.high for point in points]) - values
        shift = 0.012 * (place - (len(rules) - 1) / 2)
        axes.errorbar(
            [condition.informed + shift for condition in cells],
            values,
            yerr=np.maximum([low, high], 0),
            color=_RULE_COLOURS[place % len(_RULE_COLOURS)],
            marker=_RULE_MARKERS[place % len(_RULE_MARKERS)],
            ms=4,
            lw=1.2,
            capsize=2,
            label=rule,
        )
    # The spaces within a pair do not break.
    wanted = ", ".join(
        f"{name}\N{NO-BREAK SPACE}{share:g}" for name, share in zip(sites, shares, strict=True)
    )
    axes.set_title(fill(f"wanted: {wanted}", 34), fontsize=9)
    axes.grid(color="#dddddd", lw=0.6)
