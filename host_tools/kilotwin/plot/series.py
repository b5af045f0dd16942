"""How many robots did something in the trials of a sweep: over time, and at the end.

Trials that differ in their seed alone are drawn together: medians over time, with the range from
the lower to the upper quartile, and each trial's number at the end.
"""

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from kilotwin.errors import InputError
from kilotwin.plot.style import letters, wrapped
from kilotwin.plot.sweep import MOST_RULES, rule_look
from kilotwin.runs.reader import read_parquet
from kilotwin.sweep.conditions import chosen
from kilotwin.sweep.data_set import SERIES, TRIALS, about

_NOT_COUNTED = ("trial", "tick", "time_s")
_NO_KEYS = ("trial", "key", "seed", "robots", "not_resting", "rule", "reading", "informed")
_RESULTS = ("resting_", "share_", "result_hash")


def draw_series(folder: Path, where: Sequence[str], column: str) -> Figure:
    """Curves of a column of series.parquet; `where` chooses trials as for the other figures."""
    trials, series = _table(folder, TRIALS), _table(folder, SERIES)
    columns = [name for name in series.column_names if name not in _NOT_COUNTED]
    if column not in columns:
        given = f"--column {column}: no such column" if column else "which column? Add --column"
        raise InputError(f"{given}; {folder / SERIES} has {', '.join(columns)}")
    groups = _groups(folder, chosen(folder, trials, where))
    lines = {
        label: [_counts(series, trial, column) for trial in numbers]
        for label, numbers in groups.items()
    }
    width = 10 + letters(max(map(len, lines)), 9)
    figure = Figure(figsize=(min(width, 16), 4.5))
    figure.set_layout_engine("constrained")
    name = about(folder, "name")
    figure.suptitle(wrapped(f"{name}: {column.replace('_', ' ', 1)}", 9, 13.2), x=0.01, ha="left")
    over_time, at_the_end = figure.subplots(1, 2, width_ratios=[3, 2])
    _draw_over_time(over_time, lines)
    _draw_at_the_end(at_the_end, lines)
    return figure


def _table(folder: Path, name: str) -> pa.Table:
    try:
        return read_parquet(folder / name)
    except FileNotFoundError:
        raise InputError(
            f"{folder}: no sweep's folder with finished trials (no {name}); name one that "
            "`kilotwin sweep` made"
        ) from None
    except (pa.ArrowException, OSError) as error:
        raise InputError(
            f"{folder / name}: damaged ({str(error).splitlines()[0]}); the sweep's own command "
            "makes it anew"
        ) from None


def _groups(folder: Path, rows: list[dict[str, Any]]) -> dict[str, list[int]]:
    """The trials by what varies among them; an experiment's name says it where that varies."""
    keys = [
        key
        for key in rows[0]
        if key not in _NO_KEYS
        and not key.startswith(_RESULTS)
        and len({row[key] for row in rows}) > 1
    ]
    if "name" in keys:
        keys = ["name"]
    groups: dict[str, list[int]] = {}
    for row in rows:
        said = [str(row[key]) if key == "name" else f"{key} {row[key]}" for key in keys]
        groups.setdefault(", ".join(said) or "all trials", []).append(row["trial"])
    if len(groups) > MOST_RULES:
        raise InputError(
            f"{folder}: {len(groups)} kinds of trials, and one figure can tell {MOST_RULES} "
            f"apart; choose some, as by --where {keys[0]}={rows[0][keys[0]]}"
        )
    return groups


_Line = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Times in s, and how many robots."""


def _counts(series: pa.Table, trial: int, column: str) -> _Line:
    rows = series.filter(pc.equal(series["trial"], trial))
    return np.asarray(rows["time_s"]), np.asarray(rows[column]).astype(np.int64)


def _draw_over_time(axes: Axes, lines: dict[str, list[_Line]]) -> None:
    for place, (label, trials) in enumerate(lines.items()):
        # Trials that an interruption cut short end earlier.
        shortest = min(len(time_s) for time_s, _ in trials)
        time_s = trials[0][0][:shortest]
        counts = np.stack([count[:shortest] for _, count in trials])
        look = rule_look(place)
        axes.plot(
            time_s, np.median(counts, axis=0), color=look["color"], ls=look["ls"], label=label
        )
        if len(trials) > 1:
            low, high = np.percentile(counts, [25, 75], axis=0)
            axes.fill_between(time_s, low, high, color=look["color"], alpha=0.2, lw=0)
    axes.set(xlabel="time (s)", ylabel="robots, median and quartiles")
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(fontsize=9, loc="upper left")
    axes.grid(color="#dddddd", lw=0.6)


def _draw_at_the_end(axes: Axes, lines: dict[str, list[_Line]]) -> None:
    for place, trials in enumerate(lines.values()):
        look = rule_look(place)
        last = [int(count[-1]) for _, count in trials]
        shift = np.linspace(-0.15, 0.15, len(last)) if len(last) > 1 else np.zeros(1)
        axes.plot(place + shift, last, ls="", marker=look["marker"], ms=4, color=look["color"])
        axes.hlines(median(last), place - 0.3, place + 0.3, color=look["color"], lw=2)
    labels = [wrapped(label, 0.8, 9) for label in lines]
    axes.set_xticks(range(len(lines)), labels, fontsize=9)
    axes.set(ylabel="robots at the end, each trial and median")
    axes.set_ylim(bottom=0)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(axis="y", color="#dddddd", lw=0.6)
