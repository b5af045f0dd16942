"""The arena from above at the end of a run, robots to scale in the colour of their state."""

from typing import Any

import numpy as np
import pyarrow.compute as pc
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation
from numpy.typing import NDArray

from kilotwin.experiment.areas import Area, area_of
from kilotwin.experiment.pictures import Picture
from kilotwin.experiment.schema.experiment import Arena, ExperimentSchema, Obstacle, Site
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.spec.informed import informed_ranges
from kilotwin.experiment.spec.objects import areas_at
from kilotwin.experiment.states import States
from kilotwin.runs.palette import FLOOR, OBJECT, OBSTACLE, OUTLINE, site_fills, state_colours
from kilotwin.runs.reader import Run
from kilotwin.studies.plot.style import (
    HATCHES,
    LEGEND_LINE,
    legend_columns,
    letters,
    repeats,
    title,
    wrapped,
)

_INFORMED = "#cc79a7"


def draw_map(run: Run) -> Figure:
    """The last sample of the run."""
    robots = run.last_robots("x_m", "y_m", "heading_rad", "state")
    experiment = run.experiment
    states = [str(state) for state in robots["state"].to_pylist()]
    order = [name for name in States.of(experiment).names if name in states]
    colours = state_colours(order)
    diameter = 2 * PROFILES[experiment.swarm.profile].radius_m
    centres = np.column_stack([robots["x_m"], robots["y_m"]])
    informed = np.flatnonzero(np.isin(robots["robot"], _informed_ids(experiment))).tolist()

    figure = Figure(figsize=(10, 7.5))
    axes = figure.add_subplot()
    draw_floor(axes, experiment, run.floor())
    things = _draw_objects(axes, run, robots["tick"][0].as_py())
    point = 1 / points_per_metre(axes)
    _draw_informed(axes, centres[informed], diameter, point)
    outline = min(0.5, 0.08 * diameter / point)
    fills = [colours[state] for state in states]
    heading_rad = np.asarray(robots["heading_rad"])
    _draw_robots(axes, centres, heading_rad, diameter, fill=fills, outline=outline)
    # In a crowd others' discs cover the ring, not the rim.
    rim = min(1.2, 0.15 * diameter / point)
    _circles(axes, centres[informed], diameter, facecolor="none", edgecolor=_INFORMED, lw=rim)

    handles: list[Artist] = [
        _dot(f"{state} ({states.count(state)})", mfc=colours[state], mec=OUTLINE) for state in order
    ]
    if informed:
        label = f"informed ({len(informed)})"
        handles.append(_dot(label, mfc="none", mec=_INFORMED, mew=2.5))
    handles += [*_site_handles(experiment), *things]
    _draw_legend(axes, handles)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(steps=[1, 2, 5, 10]))
    axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    heading = f"{title(run)}, at {robots['time_s'][0].as_py():,.0f} s"
    if robots.num_rows < run.robots_number:
        heading += f", {robots.num_rows:,} of {run.robots_number:,} robots"
    axes.set_title(wrapped(heading, _room(axes)[0], 12))
    return figure


def _informed_ids(experiment: ExperimentSchema) -> list[int]:
    return [
        robot
        for _, first, count in informed_ranges(experiment)
        for robot in range(first, first + count)
    ]


def _draw_picture(axes: Axes, picture: Picture, fills: list[str]) -> None:
    colours = np.array([(0.0, 0.0, 0.0, 0.0), *(to_rgba(fill) for fill in fills)])
    (left, low), (width, height) = picture.low_m, picture.size_m
    axes.imshow(
        colours[picture.values],
        extent=(left, left + width, low, low + height),
        origin="lower",
        interpolation="nearest",
        zorder=1,
    )


def draw_floor(axes: Axes, experiment: ExperimentSchema, picture: Picture | None) -> None:
    """The floor: arena, sites, obstacles; the axes' limits are around the arena."""
    arena = area_of(experiment.arena)
    _draw_place(axes, experiment.arena, facecolor=FLOOR, edgecolor="black", lw=2)
    if picture is not None:
        _draw_picture(axes, picture, site_fills(experiment))
    for site, look in zip(experiment.site, _site_looks(experiment), strict=True):
        if site.shape != "picture":
            _draw_place(axes, site, lw=0.8, **look)
    for obstacle in experiment.obstacle:
        _draw_place(axes, obstacle, facecolor=OBSTACLE, edgecolor="black", lw=1)
    if experiment.obstacle or picture is not None:
        _draw_place(axes, experiment.arena, facecolor="none", edgecolor="black", lw=2)
    margin = 0.02 * max(arena.width, arena.height)
    half_x, half_y = arena.width / 2 + margin, arena.height / 2 + margin
    axes.set_xlim(arena.x - half_x, arena.x + half_x)
    axes.set_ylim(arena.y - half_y, arena.y + half_y)


def _draw_objects(axes: Axes, run: Run, tick: int) -> list[Patch]:
    """Objects at a tick. Returns their handle, if any were recorded then."""
    if not run.experiment.object:
        return []
    look: dict[str, Any] = {"facecolor": OBJECT, "edgecolor": OUTLINE, "lw": 1}
    table = run.objects()
    for row in table.filter(pc.equal(table["tick"], tick)).to_pylist():
        pose = [row["x_m"], row["y_m"], row["heading_rad"]]
        for part in areas_at(run.experiment.object[row["object"]], pose):
            _draw_area(axes, part, **look)
    return [Patch(label=f"object ({len(run.experiment.object)})", **look)]


def _room(axes: Axes) -> tuple[float, float]:
    """Room for the map, inches."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    box = axes.get_position(original=True)
    return float(figure.get_figwidth() * box.width), float(figure.get_figheight() * box.height)


def points_per_metre(axes: Axes) -> float:
    """The scale of a table that is drawn in equal steps along x and y."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    width, height = _room(axes)
    return 72 * min(width / (right - left), height / (high - low))


def _draw_legend(axes: Axes, handles: list[Artist]) -> None:
    """To the right; below, if it is higher than a map that is wide."""
    labels = [str(handle.get_label()) for handle in handles]
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    inches = points_per_metre(axes) / 72
    columns = legend_columns(labels, inches * (high - low))
    if columns == 1 or right - left < 1.3 * (high - low):
        axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0), ncols=columns)
        return
    longest = max(len(line) for label in labels for line in label.split("\n"))
    columns = max(1, int(inches * (right - left) / (0.6 + letters(longest))))
    below = ScaledTranslation(0, -2.5 * LEGEND_LINE, axes.figure.dpi_scale_trans)
    axes.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.0, 0.0),
        bbox_transform=axes.transAxes + below,
        ncols=columns,
    )


def _draw_place(axes: Axes, place: Arena | Obstacle | Site, **look: Any) -> Patch:
    return _draw_area(axes, area_of(place), **look)


def _draw_area(axes: Axes, area: Area, **look: Any) -> Patch:
    patch = area_patch(area, **look)
    axes.add_patch(patch)
    return patch


def area_patch(area: Area, **look: Any) -> Patch:
    """Its outline, filled."""
    if area.circle:
        return Circle((area.x, area.y), area.width / 2, **look)
    return Polygon(np.array(area.outline), closed=True, **look)


def _draw_robots(
    axes: Axes,
    centres: NDArray[np.float32],
    heading_rad: NDArray[np.float32],
    diameter: float,
    *,
    fill: list[str],
    outline: float,
) -> None:
    """Discs to scale, with a line from the middle to the front; `outline` in points."""
    _circles(axes, centres, diameter, facecolor=fill, edgecolor=OUTLINE, lw=outline)
    front = centres + diameter / 2 * np.column_stack([np.cos(heading_rad), np.sin(heading_rad)])
    lines = np.stack([centres, front], axis=1)
    axes.add_collection(LineCollection(list(lines), colors=OUTLINE, lw=outline))


def _draw_informed(axes: Axes, centres: NDArray[np.float32], diameter: float, point: float) -> None:
    """A ring around each, below all robots, so that it hides no state."""
    ring = diameter + 2 * max(0.12 * diameter, 1.2 * point)
    _circles(axes, centres, ring, facecolor=_INFORMED, lw=0)


def _circles(axes: Axes, centres: NDArray[np.float32], diameter: float, **look: Any) -> None:
    size = np.full(len(centres), diameter)
    axes.add_collection(
        EllipseCollection(
            size,
            size,
            np.zeros(len(centres)),
            units="xy",
            offsets=centres,
            offset_transform=axes.transData,
            **look,
        )
    )


def _dot(label: str, **look: Any) -> Line2D:
    return Line2D([], [], ls="", marker="o", ms=9, label=wrapped(label, 3), **look)


def _site_looks(experiment: ExperimentSchema) -> list[dict[str, Any]]:
    fills = site_fills(experiment)
    hatches = repeats(fills, HATCHES)
    return [
        {"facecolor": fill, "hatch": hatch, "edgecolor": OUTLINE}
        for fill, hatch in zip(fills, hatches, strict=True)
    ]


def _site_handles(experiment: ExperimentSchema) -> list[Artist]:
    return [
        Patch(label=wrapped(f"site {site.name}", 3), **look)
        for site, look in zip(experiment.site, _site_looks(experiment), strict=True)
    ]
