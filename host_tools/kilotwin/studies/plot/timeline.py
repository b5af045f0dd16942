"""How many robots rest on each site, or are in each state, over the time of a run."""

import numpy as np
import pyarrow as pa
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from kilotwin.errors import InputError
from kilotwin.experiment.checks.experiment import swarm_size
from kilotwin.experiment.states import States
from kilotwin.runs.palette import OUTLINE, site_fills, state_colours
from kilotwin.runs.reader import Run
from kilotwin.studies.plot.style import DASHES, legend_columns, repeats, title, wrapped

_NOT_RESTING = "#d55e00"
_STATE = "state_"  # with which columns of counts begin
_PAPER = "#e4e4e4"
"""Behind the lines: both a black and a white line show on it."""


def draw_timeline(run: Run) -> Figure:
    """A line per site in its colour; the wanted numbers are dotted where robots are informed.

    Of a program that rests on no site, a line per state.
    """
    table = _samples(run)
    experiment = run.experiment
    states = States.of(experiment)
    if not experiment.site or states.resting >= states.known:
        return draw_states(run)
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

    _label_axes(axes, run, time_s[-1], size)
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


def draw_states(run: Run) -> Figure:
    """How many robots are in each state: a line per state that occurs, in its colour."""
    _samples(run)
    size = swarm_size(run.experiment)
    time_s, in_state = _in_states(run)
    occurring = [name for name in States.of(run.experiment).names if name in in_state]
    occurring = [name for name in occurring if in_state[name].any()]
    colours = state_colours(occurring)

    figure = Figure(figsize=(10, 5))
    axes = figure.add_subplot(facecolor=_PAPER)
    for place, name in enumerate(occurring):
        counts = in_state[name]
        axes.plot(
            time_s,
            counts,
            color=colours[name],
            lw=2,
            ls=DASHES[place % len(DASHES)],
            path_effects=_outlined(3.2),
            label=wrapped(f"{name} ({counts[-1]})", 3.5),
        )
    _label_axes(axes, run, time_s[-1], size)
    axes.legend(
        loc="upper left",
        bbox_to_anchor=(1.0, 1.0),
        title=f"{_counted(run)} by state (at the end)",
        ncols=legend_columns(["", *occurring], 3.85),
    )
    return figure


def _counted(run: Run) -> str:
    """Whom states are counted of: see _in_states()."""
    chosen = run.experiment.record.robots_of(run.robots_number)
    if chosen is None or States.of(run.experiment).known:
        return "robots"
    return f"{len(chosen):,} recorded robots"


def _in_states(run: Run) -> tuple[NDArray[np.float64], dict[str, NDArray[np.int64]]]:
    """Times, and robots by state at each: of the rows of robots, or, where not all robots are
    recorded or not their states, by what was counted, which is states with a name."""
    record, size = run.experiment.record, run.robots_number
    chosen = record.robots_of(size)
    partly = chosen is not None or record.robots_s or not record.has_column("state")
    if partly and States.of(run.experiment).known:
        table = run.sites()
        counted = [name for name in table.column_names if name.startswith(_STATE)]
        counts = {name.removeprefix(_STATE): np.asarray(table[name]) for name in counted}
        return np.asarray(table["time_s"]), counts
    rows = run.robots("state")
    if rows.num_rows == 0:
        run.last_robots()  # which says why
    size = size if chosen is None else max(1, len(chosen))
    shown = rows["state"].combine_chunks()
    indices, words = np.asarray(shown.indices), shown.dictionary.to_pylist()
    samples = len(indices) // size
    by_sample = indices[: samples * size].reshape(samples, size)
    time_s = np.unique(np.asarray(rows["time_s"]))[:samples]
    return time_s, {name: (by_sample == place).sum(axis=1) for place, name in enumerate(words)}


def _samples(run: Run) -> pa.Table:
    table = run.sites()
    if table.num_rows == 0:
        raise InputError(f"{run.folder}: no sample was recorded; let the run go on for longer")
    return table


def _label_axes(axes: Axes, run: Run, end_s: float, size: int) -> None:
    axes.set(xlabel="time (s)", ylabel="robots", ylim=(-0.02 * size, 1.04 * size))
    axes.set_xlim(0, max(end_s, run.experiment.record.sample_s))
    axes.xaxis.set_major_formatter(lambda second, _: f"{second:,.10g}")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    axes.grid(color="white", lw=0.8)
    axes.set_title(wrapped(title(run), 7.75, 12))


def _outlined(width: float) -> list[patheffects.AbstractPathEffect]:
    """A dark edge, so that a light line is seen."""
    return [patheffects.Stroke(linewidth=width, foreground=OUTLINE), patheffects.Normal()]
