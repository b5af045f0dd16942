"""What the host and `kilogrid_modules/sites` say to each other: cell codes."""

import numpy as np
from numpy.typing import NDArray

from kilotwin.grid.layout import Cells, Layout, Module, of_module

MOST_SITES = 15
# The 3-bit colours of a module's lights, in the order of their numbers.
LIGHTS = ("off", "red", "green", "yellow", "blue", "magenta", "cyan", "white")
WALL_LIGHT = "red"
_SITE_LIGHTS = ("green", "blue", "yellow", "magenta", "cyan", "white")

_WALL = 0x80
_LIGHT_SHIFT = 4


def light_of(number: int, chosen: str | None) -> int:
    """The light of a site's cells: what the experiment says, or one after the other."""
    return LIGHTS.index(chosen or _SITE_LIGHTS[(number - 1) % len(_SITE_LIGHTS)])


def configurations(
    layout: Layout, cells: Cells, walls: NDArray[np.bool_], lights: NDArray[np.uint8]
) -> dict[Module, bytes]:
    """What every module is told: a code per cell. `lights[n]` is that of site n, 0 of none."""
    codes: Cells = np.bitwise_or(cells, lights[cells] << _LIGHT_SHIFT, dtype=np.uint8)
    codes[walls] = _WALL | LIGHTS.index(WALL_LIGHT) << _LIGHT_SHIFT | cells[walls]
    return {module: bytes(of_module(codes, module)) for module in layout.modules()}
