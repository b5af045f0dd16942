"""Where cells lie and what they are: geometry of a Kilogrid, sites and walls drawn on its cells.

The grid's centre is (0, 0), the arena's. Module (x, y) is column and row from the lower left, y
upwards; its cells are 0 top left, 1 top right, 2 bottom left, 3 bottom right. Arrays of cells are
[rows * 2, columns * 2], row 0 at the bottom.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kilotwin.experiment.areas import area_of, inside
from kilotwin.experiment.pictures import Picture
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.files.headers import CELL_M, CELLS_PER_MODULE

Module = tuple[int, int]
Cells = NDArray[np.uint8]

# A site's border that goes through a cell's middle, but for rounding, has the cell inside.
_ROUNDING_M = 1e-9


@dataclass(frozen=True)
class Layout:
    """A grid of modules on CAN buses."""

    columns: int
    rows: int
    buses: int

    @staticmethod
    def of(keys: ExperimentSchema) -> "Layout":
        """Layout of an experiment that has a [grid]."""
        assert keys.grid is not None
        return Layout(keys.grid.columns, keys.grid.rows, keys.grid.buses)

    def on_buses(self, buses: int) -> "Layout":
        """The same modules on so many buses."""
        return replace(self, buses=buses)

    def rows_of(self, bus: int) -> range:
        """The rows of modules on a bus: whole rows, the lowest first, as equally as can be."""
        return range(bus * self.rows // self.buses, (bus + 1) * self.rows // self.buses)

    def modules_of(self, bus: int) -> list[Module]:
        """The modules on a bus, row by row."""
        return [(x, y) for y in self.rows_of(bus) for x in range(self.columns)]

    def modules(self) -> Iterator[Module]:
        """All modules, row by row."""
        return ((x, y) for y in range(self.rows) for x in range(self.columns))

    def bus_of(self, module: Module) -> int:
        """The bus that a module is on."""
        return next(bus for bus in range(self.buses) if module[1] in self.rows_of(bus))

    def centres(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """x in m of each column of cells, y in m of each row of cells."""
        across, up = (
            (np.arange(2 * count, dtype=np.float64) + 0.5 - count) * CELL_M
            for count in (self.columns, self.rows)
        )
        return across, up

    def centre(self, module: Module, cell: int) -> tuple[float, float]:
        """A cell's middle, m."""
        row, column = place_of(module, cell)
        across, up = self.centres()
        return float(across[column]), float(up[row])

    def below(
        self, x_m: NDArray[np.floating], y_m: NDArray[np.floating]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Row and column of the cells below places; the nearest ones for places beside the grid."""
        column = np.floor(x_m / CELL_M + self.columns).astype(np.intp)
        row = np.floor(y_m / CELL_M + self.rows).astype(np.intp)
        return np.clip(row, 0, 2 * self.rows - 1), np.clip(column, 0, 2 * self.columns - 1)


def place_of(module: Module, cell: int) -> tuple[int, int]:
    """Row and column of a module's cell in arrays of cells."""
    return 2 * module[1] + (cell < 2), 2 * module[0] + cell % 2


def of_module(cells: Cells, module: Module) -> list[int]:
    """The values of a module's cells 0 to 3."""
    return [int(cells[place_of(module, cell)]) for cell in range(CELLS_PER_MODULE)]


def sites_on_cells(keys: ExperimentSchema, layout: Layout, picture: Picture | None = None) -> Cells:
    """Each cell's site number, 0 for none: a cell is of the site that its middle lies in.

    `picture` has the sites that are drawn.
    """
    across, up = np.meshgrid(*layout.centres())
    cells: Cells = np.zeros(across.shape, dtype=np.uint8)
    if picture is not None:
        cells = picture.at(across, up)
    for number, site in enumerate(keys.site, start=1):
        if site.shape != "picture":
            cells[inside(area_of(site), across, up, _ROUNDING_M)] = number
    return cells


def walls_on_cells(layout: Layout, width: int) -> NDArray[np.bool_]:
    """Which cells are wall: a ring of that many cells along the edge."""
    walls = np.ones((2 * layout.rows, 2 * layout.columns), dtype=bool)
    walls[width : 2 * layout.rows - width, width : 2 * layout.columns - width] = False
    return walls
