"""How many robots rest on each site, and how many do not rest, over the time of a run."""

import numpy as np
from matplotlib import patheffects
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from kilotwin.errors import InputError
from kilotwin.experiment.checks import swarm_size
from kilotwin.plot.style import (
    DASHES,
    OUTLINE,
    legend_columns,
    repeats,
    site_fills,
    title,
    wrapped,
)
from kilotwin.runs.reader import Run

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
    fills = site_fills(experiment)
    expected: dict[float, str] = {}
    for site, fill, dashes in zip(experiment.site, fills, repeats(fills, DASHES), strict=True):
        resting = np.asarray(table[f"resting_{site.name}"])
        text = f"{resting[-1]}"
        if experiment.swarm.informed > 0:
            wanted = size * experiment.swarm.informed_for.get(site.name, 0.0)
            # A count expected on several sites is a line of none of their colours.
            expected[wanted] = OUTLINE if wanted in expected else fill
            text += f",\N{NO-BREAK SPACE}wanted\N{NO-BREAK SPACE}{wanted:g}"
        label = wrapped(f"resting on {site.name} ({text})", 3.5)
        axes.plot(
            time_s, resting, color=fill, lw=2, ls=dashes, path_effects=_outlined(3.2), label=label
        )
    for wanted, colour in expected.items():
        axes.axhline(wanted, color=colour, ls=":", lw=1.6, path_effects=_outlined(2.4))
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
    axes.set_title(wrapped(title(run), 7.75, 12))
    handles, labels = axes.get_legend_handles_labels()
    if expected:
        handles.append(Line2D([], [], color=OUTLINE, ls=":", lw=1.6))
        labels.append("wanted")
    axes.legend(
        handles,
        labels,
        loc="upper left",
        bbox_to_anchor=(1.0, 1.0),
        title="robots (at the end)",
        ncols=legend_columns(["", *labels], 3.85),
    )
    return figure


def _outlined(width: float) -> list[patheffects.AbstractPathEffect]:
    """A dark edge, so that a light line is seen."""
    return [patheffects.Stroke(linewidth=width, foreground=OUTLINE), patheffects.Normal()]
