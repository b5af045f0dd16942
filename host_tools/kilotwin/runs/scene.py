"""The scene of a run: all that stands still in its picture, with colours and names."""

import contextlib
import json
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kilotwin.errors import InputError
from kilotwin.experiment.areas import Area, area_of
from kilotwin.experiment.colours import LED_VALUES, led_rgb
from kilotwin.experiment.pictures import Picture
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.spec.grid_layout import Layout, walls_on_cells
from kilotwin.experiment.spec.grid_plan import is_ours, plan_of
from kilotwin.experiment.spec.informed import informed_ranges
from kilotwin.experiment.spec.objects import parts_of
from kilotwin.experiment.states import States
from kilotwin.files.headers import CELL_M
from kilotwin.runs.folder import FAILURES, FAULT, UIDS, WHY
from kilotwin.runs.light import light_of
from kilotwin.runs.palette import site_fills, state_colours
from kilotwin.runs.pixels import as_png
from kilotwin.runs.reader import Run
from kilotwin.units import TICK_S

PASSAGE = ("begin_s", "at_s", "from", "to")
"""Keys of a frame from robot to robot: when it began and ended, indices of sender and receiver."""


def _why(run: Run) -> dict[str, Any] | None:
    """The chain that `kilotwin why` has told last; None: there is none."""
    try:
        told = json.loads((run.folder / WHY).read_text())
        lines = [{key: one[key] for key in PASSAGE} for one in told["lines"]]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return {"lines": lines}


def scene_of(run: Run) -> dict[str, Any]:
    """For the page, in JSON; lengths in metres, colours as #rrggbb."""
    experiment = run.experiment
    states = States.of(experiment)
    named = state_colours(states.names)
    return {
        "name": experiment.name,
        "seed": experiment.seed,
        "folder": run.folder.name,
        "status": str(run.manifest.get("status", "")),
        "emulated": "engine" in run.manifest,
        "also": experiment.record.also or [],
        "failures": sorted({*FAILURES, FAULT}),
        "robots": run.robots_number,
        "uids": run.manifest.get(UIDS),
        "why": _why(run),
        "radius_m": PROFILES[experiment.swarm.profile].radius_m,
        "range_m": experiment.medium.range_m,
        "duration_s": experiment.duration_s,
        "tick_s": TICK_S,
        "arena": _shape(area_of(experiment.arena)),
        "sites": _sites(experiment),
        "floor": _floor(run),
        "light": light_of(run),
        "obstacles": [_shape(area_of(obstacle)) for obstacle in experiment.obstacle],
        "objects": [[_shape(part) for part in parts_of(thing)] for thing in experiment.object],
        "grid": _grid(run),
        "informed": [
            [first, first + count, site] for site, first, count in informed_ranges(experiment)
        ],
        "states": {
            "names": states.names,
            "known": states.known,
            "of_led": states.of_led.tolist(),
            "colours": [named[name] for name in states.names],
        },
        "leds": ["#{:02x}{:02x}{:02x}".format(*_shown(led)) for led in range(LED_VALUES)],
        "metrics": {
            f"metric_{name}": {"unit": metric.shown_unit, "meaning": metric.meaning}
            for name, metric in experiment.metric.items()
        },
    }


def _shown(led: int) -> tuple[int, ...]:
    """An LED's colour on a screen: light adds, and intensity 1 of 3 is seen well in a lab."""
    return tuple(round(255 * math.sqrt(level / 3)) for level in led_rgb(led))


def _shape(area: Area) -> dict[str, Any]:
    if area.circle:
        return {"circle": [area.x, area.y, area.width / 2]}
    return {"polygon": [list(corner) for corner in area.outline]}


def _sites(experiment: ExperimentSchema) -> list[dict[str, Any]]:
    return [
        {
            "name": site.name,
            "colour": fill,
            **({} if site.shape == "picture" else _shape(area_of(site))),
        }
        for site, fill in zip(experiment.site, site_fills(experiment), strict=True)
    ]


def _floor(run: Run) -> dict[str, Any] | None:
    """Sites that are drawn, as a picture; None without, or if its file is there no more."""
    picture = run.floor()
    if picture is None:
        return None
    (left, low), (width, height) = picture.low_m, picture.size_m
    return {
        "box": [left, low, left + width, low + height],
        "png": as_png(_coloured(picture, site_fills(run.experiment))),
    }


def _coloured(picture: Picture, fills: list[str]) -> NDArray[np.uint8]:
    """Where no site is, nothing is seen."""
    colours = [(0, 0, 0, 0)]
    colours += [(*bytes.fromhex(fill.removeprefix("#")), 255) for fill in fills]
    return np.array(colours, dtype=np.uint8)[picture.values]


def _grid(run: Run) -> dict[str, Any] | None:
    """Modules, wall cells, and each cell's site from a time on; cells row by row from below."""
    grid = run.experiment.grid
    if grid is None:
        return None
    layout = Layout.of(run.experiment)
    maps = []
    with contextlib.suppress(InputError):  # a .kconf may be there no more
        plan = plan_of(run.experiment, run.origin, run.floor())
        assert plan is not None
        maps = [[at_s, cells.ravel().tolist()] for at_s, cells in plan.site_maps]
    return {
        "columns": layout.columns,
        "rows": layout.rows,
        "cell_m": CELL_M,
        # A .kconf says by itself which cells are wall; which of its values mean so is not known.
        "walls": []
        if grid.configuration is not None
        else np.flatnonzero(walls_on_cells(layout, grid.wall_cells)).tolist(),
        "maps": maps,
        # Cells of a lab's own program show what was recorded, and no plan knows it.
        "recorded": not is_ours(grid) and "engine" in run.manifest,
    }
