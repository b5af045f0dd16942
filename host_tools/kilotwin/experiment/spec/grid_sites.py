"""Cell codes: how the host configures `kilogrid_modules/sites`."""

from typing import get_args

import numpy as np
from numpy.typing import NDArray

from kilotwin.experiment.schema.grid import CellColour
from kilotwin.experiment.spec.grid_layout import Cells, Layout, Module, of_module

# The 3-bit colours of a module's lights, in the order of their numbers.
LIGHTS = get_args(CellColour)
_WALL_LIGHT = "red"
_SITE_LIGHTS = ("green", "blue", "yellow", "magenta", "cyan", "white")

# kilogrid_modules/sites/cell.h: from 0x80 up a code has light and site, or wall.
_WHOLE = 0x80
_LIGHT_SHIFT = 4
_WALL = 15


def light_of(number: int, chosen: str | None) -> int:
    """The number of the light of a site's cells: `chosen`, or one after the other."""
    return LIGHTS.index(chosen or _SITE_LIGHTS[(number - 1) % len(_SITE_LIGHTS)])


def configurations(
    layout: Layout, cells: Cells, walls: NDArray[np.bool_], lights: NDArray[np.uint8]
) -> dict[Module, bytes]:
    """Every module's configuration: a code per cell. `lights[n]` is that of site n, 0 of none."""
    wall = _WHOLE | LIGHTS.index(_WALL_LIGHT) << _LIGHT_SHIFT | _WALL
    codes: Cells = np.where(walls, wall, _WHOLE | lights[cells] << _LIGHT_SHIFT | cells)
    codes = codes.astype(np.uint8)
    return {module: bytes(of_module(codes, module)) for module in layout.modules()}
