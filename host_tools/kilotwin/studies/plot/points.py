"""Robots smaller than a pixel: a pixel has the mean colour of the robots in it."""

import numpy as np
from numpy.typing import NDArray

RADIUS_PX = 0.5
"""Robots with a smaller radius are points: one of them covers less than a pixel."""


class Points:
    """Draws what `Discs` draws where those would be too small to see: a million in one step."""

    def __init__(self, fills: NDArray[np.uint8]) -> None:
        """`fills`: [colours, 3] of robots."""
        self._fills = fills.astype(np.float64)

    def draw(
        self,
        picture: NDArray[np.uint8],
        centres: NDArray[np.floating],
        heading_rad: NDArray[np.floating] | None,
        fill: NDArray[np.integer],
        table: tuple[slice, slice],
    ) -> None:
        """As Discs.draw(); `heading_rad` is not seen."""
        del heading_rad
        rows, columns = table
        height, width = rows.stop - rows.start, columns.stop - columns.start
        column, row = centres[:, 0] - columns.start, centres[:, 1] - rows.start
        here = np.flatnonzero((column >= 0) & (column < width) & (row >= 0) & (row < height))
        place = row[here].astype(np.int64) * width + column[here].astype(np.int64)
        number = np.bincount(place, minlength=height * width)
        seen = np.flatnonzero(number)
        part = picture[table].reshape(-1, 4)
        for colour, of_fill in enumerate(self._fills.T):
            summed = np.bincount(place, of_fill[fill[here]], height * width)
            part[seen, colour] = np.floor(summed[seen] / number[seen] + 0.5)
        picture[table] = part.reshape(height, width, 4)
