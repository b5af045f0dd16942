"""How many robots rest on each site, and how many do not rest, over the time of a run."""

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from kilotwin.errors import InputError
from kilotwin.experiment_checks import swarm_size
from kilotwin.plot.style import OUTLINE, site_fills, title
from kilotwin.run_reader import Run

_NOT_RESTING = "#d55e00"
_PAPER = "#e4e4e4"
"""Behind the lines: both a black and a white line show on it."""


def draw_timeline(run: Run) -> Figure:
    """A line per site in its colour; the wanted numbers are dotted where robots are informed."""
    table = run.sites()
    if table.num_rows == 0:
        raise InputError(f"{run.folder}: no sample was recorded; let the run go on for longer")
    experiment = run.experiment
    size = swarm_size(experiment)
    time_s = np.asarray(table["time_s"])

    figure = Figure(figsize=(10, 5))
    axes = figure.add_subplot(facecolor=_PAPER)
    wishes: dict[float, list[str]] = {}
    for site, fill in zip(experiment.site, site_fills(experiment), strict=True):
        resting = np.asarray(table[f"resting_{site.name}"])
        _line(axes, time_s, resting, fill, f"resting on {site.name} ({resting[-1]})")
        if experiment.swarm.informed > 0:
            wanted = size * experiment.swarm.informed_for.get(site.name, 0.0)
            axes.axhline(wanted, color=fill, ls=":", lw=1.6, path_effects=_outlined(2.4))
            wishes.setdefault(wanted, []).append(site.name)
    for wanted, sites in wishes.items():
        each = " each" if len(sites) > 1 else ""
        axes.annotate(
            f"wanted on {' and '.join(sites)}: {wanted:g}{each}",
            (1.0, wanted),
            xycoords=("axes fraction", "data"),
            xytext=(-4, 3),
            textcoords="offset points",
            ha="right",
            fontsize=9,
        )
    elsewhere = np.asarray(table["not_resting"])
    axes.plot(
        time_s,
        elsewhere,
        color=_NOT_RESTING,
        ls="--",
        lw=1.5,
        label=f"not resting ({elsewhere[-1]})",
    )

    axes.set(xlabel="time (s)", ylabel="robots", ylim=(-0.02 * size, 1.04 * size))
    axes.set_xlim(0, max(time_s[-1], experiment.record.sample_s))
    axes.xaxis.set_major_formatter(lambda second, _: f"{second:,.10g}")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    axes.grid(color="white", lw=0.8)
    axes.set_title(title(run))
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), title="robots (at the end)")
    return figure


def _line(
    axes: Axes, x: NDArray[np.float64], y: NDArray[np.uint32], colour: str, label: str
) -> None:
    axes.plot(x, y, color=colour, lw=2, path_effects=_outlined(3.2), label=label)


def _outlined(width: float) -> list[patheffects.AbstractPathEffect]:
    """A dark edge, so that a light line is seen."""
    return [patheffects.Stroke(linewidth=width, foreground=OUTLINE), patheffects.Normal()]
