"""Plan of an experiment for a grid: each module's configuration, orders in mid-run, site maps.

Pure: no bus, no clock.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from kilotwin.experiment.files import find_file, shown
from kilotwin.experiment.pictures import Picture
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.grid import SITES, Grid, GridChange
from kilotwin.experiment.spec import grid_sites as sites
from kilotwin.experiment.spec import kconf
from kilotwin.experiment.spec.grid_layout import (
    Cells,
    Layout,
    Module,
    sites_on_cells,
    walls_on_cells,
)
from kilotwin.experiment.spec.serials import read_serials
from kilotwin.experiment.text import ExperimentText
from kilotwin.experiment.toml_lines import KeyPath
from kilotwin.files.places import names_ours

Configuration = Mapping[Module, kconf.Content]
"""Bytes that a module is to have, or the configurations that a `.kconf` file sends it in turn."""


@dataclass(frozen=True)
class Settings:
    """How the host polls and orders modules; keys of [grid], times in seconds."""

    poll_s: float = 0.4
    poll_window: int = 16
    poll_timeout_s: float = 0.4
    pace_s: float = 0.001
    hold_s: float = 2.0
    rounds: int = 2
    health: bool = False


@dataclass(frozen=True)
class Order:
    """An order in mid-run, `at_s` after 0. `change` has the modules that are configured anew."""

    at_s: float
    kind: Literal["pause", "resume", "change"]
    configuration: Configuration | None = None


@dataclass(frozen=True)
class GridPlan:
    """An experiment as the host of a grid carries it out.

    `site_maps` are each cell's site number, from a time on; the first one from the begin.
    """

    layout: Layout
    settings: Settings
    configuration: Configuration
    orders: tuple[Order, ...]
    site_maps: tuple[tuple[float, Cells], ...]
    serials: Mapping[int, str]


def plan_of(
    keys: ExperimentSchema, origin: ExperimentText, picture: Picture | None = None
) -> GridPlan | None:
    """The plan of an experiment with a [grid]; InputError names the key, or the file and line.

    `picture` has sites that are drawn.
    """
    if keys.grid is None:
        return None
    layout = Layout.of(keys)
    now = sites_on_cells(keys, layout, picture)
    site_maps = [(0.0, now)]
    configuration = _configuration(keys, layout, now, origin)
    orders = [Order(c.at_s, "pause" if c.send != "run" else "resume") for c in keys.command or []]
    current: dict[Module, kconf.Content] = dict(configuration)
    for index, change in sorted(enumerate(keys.grid.change), key=lambda item: item[1].at_s):
        if change.swap is not None:
            now = _swapped(keys, now, change)
            wanted = _of_sites(keys, layout, now)
            site_maps.append((change.at_s, now))
        else:
            assert change.configuration is not None
            path: KeyPath = ("grid", "change", index, "configuration")
            wanted = _read(change.configuration, path, layout, origin)
        changed = {module: to for module, to in wanted.items() if current.get(module) != to}
        current.update(changed)
        orders.append(Order(change.at_s, "change", changed))
    return GridPlan(
        layout,
        settings_of(keys.grid),
        configuration,
        tuple(sorted(orders, key=lambda order: order.at_s)),
        tuple(site_maps),
        _serials(keys.grid, origin),
    )


def settings_of(grid: Grid) -> Settings:
    """The controller's part of [grid]."""
    return Settings(
        poll_s=grid.poll_s,
        poll_window=grid.poll_window,
        poll_timeout_s=grid.poll_timeout_s,
        pace_s=grid.pace_s,
        hold_s=grid.hold_s,
        rounds=grid.rounds,
        health=grid.health,
    )


def _configuration(
    keys: ExperimentSchema, layout: Layout, cells: Cells, origin: ExperimentText
) -> Configuration:
    assert keys.grid is not None
    if keys.grid.configuration is not None:
        return _read(keys.grid.configuration, ("grid", "configuration"), layout, origin)
    # Only a lab knows the configuration of its own program.
    return _of_sites(keys, layout, cells) if is_ours(keys.grid) else {}


def is_ours(grid: Grid) -> bool:
    """Whether the modules run `kilogrid_modules/sites`."""
    return names_ours(grid.program, SITES)


def _read(written: str, path: KeyPath, layout: Layout, origin: ExperimentText) -> Configuration:
    file = shown(find_file(written, path, origin))
    return kconf.configurations(kconf.read(file), layout.columns, layout.rows, str(file))


def _of_sites(keys: ExperimentSchema, layout: Layout, cells: Cells) -> Configuration:
    assert keys.grid is not None
    lights = [0] + [
        sites.light_of(number, site.light) for number, site in enumerate(keys.site, start=1)
    ]
    return sites.configurations(
        layout,
        cells,
        walls_on_cells(layout, keys.grid.wall_cells),
        np.array(lights, dtype=np.uint8),
    )


def _swapped(keys: ExperimentSchema, cells: Cells, change: GridChange) -> Cells:
    assert change.swap is not None
    names = [site.name for site in keys.site]
    one, other = (names.index(name) + 1 for name in change.swap)
    swapped = cells.copy()
    swapped[cells == one] = other
    swapped[cells == other] = one
    return swapped


def _serials(grid: Grid, origin: ExperimentText) -> Mapping[int, str]:
    if grid.kilobot_ids is None:
        return {}
    return read_serials(find_file(grid.kilobot_ids, ("grid", "kilobot_ids"), origin))
