"""The result of a search, as Markdown, JSON and figures in its folder."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kilotwin.files.drafts import draft_of
from kilotwin.studies.plot import style
from kilotwin.studies.search.optimise import Found, Tried
from kilotwin.studies.search.sensitivity import Sensitivity
from kilotwin.units import counted

_LISTED = 10


def write(folder: Path, found: Found | Sensitivity) -> str:
    """Writes report.txt, report.json and the figures; returns the text."""
    if isinstance(found, Found):
        text, figures = _optimum_text(found), _figures(found)
    else:
        text, figures = _sensitivity_text(found), {"influence": _influence_figure(found)}
    for name, figure in figures.items():
        style.save(figure, folder / f"{name}.png")
    for name, content in (("txt", text + "\n"), ("json", json.dumps(as_dict(found), indent=2))):
        with draft_of(folder / f"report.{name}") as draft:
            draft.write_text(content)
    return text


def as_dict(found: Found | Sensitivity) -> dict[str, Any]:
    """The --json object."""
    made: dict[str, Any] = _plain(
        asdict(found)
        if isinstance(found, Sensitivity)
        else {
            "goals": [asdict(goal) for goal in found.search.goals],
            "over": [axis.text for axis in found.search.axes],
            "best": [asdict(one) for one in found.front[:_LISTED]],
            "tried": [asdict(one) for one in found.tried],
            "importance": found.importance,
            "confirmed": None if found.confirmed is None else asdict(found.confirmed),
            "trials": found.trials,
        }
    )
    return made


def _plain(value: Any) -> Any:
    """JSON has no NaN."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def _optimum_text(found: Found) -> str:
    search = found.search
    goals = [f"{goal.metric} ({goal.direction})" for goal in search.goals]
    keys = [axis.key for axis in search.axes]
    pruned = sum(one.is_pruned for one in found.tried)
    lines = [
        f"{counted(len(found.tried), 'point')}, {counted(found.trials, 'trial')}; "
        f"{counted(search.repeats, 'repeat')} a point"
        + (f", {pruned} points given up before" if pruned else ""),
        "",
    ]
    if not found.front:
        return "\n".join([*lines, "no point has a value: see failed/ and metrics_failed"])
    several = len(goals) > 1
    lines += ["The front: no point is better in all." if several else "The best points:", ""]
    lines += [f"| {' | '.join([*keys, *goals])} |", "|---" * (len(keys) + len(goals)) + "|"]
    lines += [_row(one, keys) for one in found.front[:_LISTED]]
    if found.importance:
        shares = ", ".join(f"{key} {value:.2f}" for key, value in found.importance.items())
        lines += ["", f"How much keys matter for {search.goals[0].metric}: {shares}"]
    if (sure := found.confirmed) is not None:
        lines += [
            "",
            f"With {sure.seeds} seeds of their own: the first of them {sure.best}, the experiment "
            f"as it is {sure.as_it_is}, gain {sure.gain}",
        ]
    return "\n".join(lines)


def _row(one: Tried, keys: Sequence[str]) -> str:
    shown = [one.point[key] for key in keys]
    cells = [f"{value:g}" if isinstance(value, float) else str(value) for value in shown]
    return f"| {' | '.join([*cells, *(f'{mean:.4g}' for mean in one.means)])} |"


def _sensitivity_text(found: Sensitivity) -> str:
    heads = ("mu*", "sigma") if found.method == "morris" else ("S1, alone", "ST, in all")
    lines = [
        f"{found.method}: {counted(found.points, 'point')}, {counted(found.trials, 'trial')}, of "
        f"{found.metric}",
        "",
        f"| key | {heads[0]} | {heads[1]} |",
        "|---|---|---|",
    ]
    for one in found.influences:
        more = f"{one.more:.3g}"
        if not math.isnan(one.more_error):
            more += f" +- {one.more_error:.2g}"
        lines.append(f"| {one.key} | {one.main:.3g} +- {one.main_error:.2g} | {more} |")
    return "\n".join(lines)


def _figures(found: Found) -> dict[str, Figure]:
    figures = {"points": style.draw(lambda: _points_figure(found))}
    if len(found.search.goals) == 1:
        figures["history"] = style.draw(lambda: _history_figure(found))
    else:
        figures["front"] = style.draw(lambda: _front_figure(found))
    return figures


def _whole(found: Found) -> list[Tried]:
    return [one for one in found.tried if not any(map(math.isnan, one.means))]


def _points_figure(found: Found) -> Figure:
    """The first goal by each key."""
    axes_of = found.search.axes
    figure = Figure(figsize=(3.6 * len(axes_of) + 0.6, 3.6))
    figure.set_layout_engine("constrained")
    panels = figure.subplots(1, len(axes_of), squeeze=False, sharey=True)[0]
    for panel, axis in zip(panels, axes_of, strict=True):
        for is_pruned, look in ((False, style.line_look(0)), (True, style.line_look(4))):
            some = [one for one in _whole(found) if one.is_pruned == is_pruned]
            values = [one.point[axis.key] for one in some]
            if axis.choices:
                values = [axis.choices.index(value) for value in values]
            means = [one.means[0] for one in some]
            panel.plot(values, means, ls="", marker=look["marker"], ms=4, color=look["color"])
        if axis.choices:
            panel.set_xticks(range(len(axis.choices)), [str(choice) for choice in axis.choices])
        panel.set_xscale("log" if axis.log else "linear")
        panel.set_xlabel(axis.key)
        panel.grid(color="#dddddd", lw=0.6)
    panels[0].set_ylabel(f"{found.search.goals[0].metric}, mean of repeats")
    return figure


def _history_figure(found: Found) -> Figure:
    figure, axes = _one_panel()
    best, values = math.nan, []
    is_better = max if found.search.goals[0].direction == "max" else min
    for one in found.tried:
        if not one.is_pruned and not math.isnan(one.means[0]):
            best = one.means[0] if math.isnan(best) else is_better(best, one.means[0])
        values.append(best)
    means = [one.means[0] for one in found.tried]
    axes.plot(range(1, len(means) + 1), means, ls="", marker="o", ms=4, label="a point")
    axes.step(range(1, len(values) + 1), values, where="post", color="#d55e00", label="the best")
    axes.set(xlabel="points", ylabel=f"{found.search.goals[0].metric}, mean of repeats")
    axes.legend()
    return figure


def _front_figure(found: Found) -> Figure:
    figure, axes = _one_panel()
    first, second = found.search.goals[:2]
    some = np.array([one.means[:2] for one in _whole(found)]).reshape(-1, 2)
    front = np.array(sorted(one.means[:2] for one in found.front)).reshape(-1, 2)
    axes.plot(*some.T, ls="", marker="o", ms=4, color="#56b4e9", label="a point")
    axes.plot(*front.T, marker="s", ms=5, color="#d55e00", label="the front")
    axes.set(
        xlabel=f"{first.metric} ({first.direction})", ylabel=f"{second.metric} ({second.direction})"
    )
    axes.legend()
    return figure


def _influence_figure(found: Sensitivity) -> Figure:
    def drawing() -> Figure:
        figure, axes = _one_panel()
        places = np.arange(len(found.influences))[::-1]
        names = ("mu*", "sigma") if found.method == "morris" else ("alone", "in all")
        for shift, part, name in ((0.2, "main", names[0]), (-0.2, "more", names[1])):
            values = [getattr(one, part) for one in found.influences]
            errors = np.nan_to_num([getattr(one, f"{part}_error") for one in found.influences])
            look = style.line_look(0 if shift > 0 else 1)
            axes.barh(
                places + shift, values, 0.4, xerr=errors, label=name, color=look["color"], capsize=2
            )
        axes.set_yticks(places, [one.key for one in found.influences])
        axes.set_xlabel(f"influence on {found.metric}, with 95 % intervals")
        axes.legend()
        return figure

    return style.draw(drawing)


def _one_panel() -> tuple[Figure, Axes]:
    figure = Figure(figsize=(7, 4.2))
    figure.set_layout_engine("constrained")
    axes = figure.add_subplot()
    axes.grid(color="#dddddd", lw=0.6)
    return figure, axes
