"""Robots drawn straight into a picture's pixels, all in a few steps over arrays."""

import numpy as np
from numpy.typing import NDArray

_PHASES = 4  # places within a pixel that are told apart, along x and along y
_FINE = 8  # pixels of radius from which headings are told apart more finely
_MOST_KEPT = 10_000_000  # pixels of all shapes
_AT_ONCE = 500_000
# By their last byte: pixels of shapes that cover nothing, and from where on not all.
_NOTHING = np.uint32(0xFF000000)
_EDGE = np.uint32(0x01000000)
_SOLID = np.uint32(0xFF000000)


class Discs:
    """Discs with an outline and a line to the front, edges smoothed; later ones are in front."""

    def __init__(
        self,
        radius: float,
        lines: tuple[float, float],
        line_colour: NDArray[np.uint8],
        fills: NDArray[np.uint8],
    ) -> None:
        """`radius`: to the middle of the outline; `lines`: widths of outline and line to the front,
        both of that colour, [3]; all in pixels. `fills`: [colours, 3] of discs."""
        self._radius = radius
        self._outline, self._front = lines
        self._line_colour = line_colour.astype(np.float32)
        self._fills = fills.astype(np.float32)
        self._turns = 64 if radius < _FINE else 256
        most = radius + max(lines) / 2 + 1.21  # from the middle of a pixel to what is covered
        grid = np.mgrid[-int(most) : int(most) + 1, -int(most) : int(most) + 1].reshape(2, -1)
        self._rows, self._columns = grid[:, np.hypot(*grid) <= most].astype(np.int32)
        self._forget()

    def _forget(self) -> None:
        # A shape in each colour: what it adds to a pixel, in bytes of red, green and blue, and how
        # much of what is below is seen, 0 to 255. Its line to the front is left out in the last
        # turn.
        self._shapes = np.zeros((0, len(self._rows)), dtype=np.uint32)
        ways = len(self._fills) * (self._turns + 1) * _PHASES**2
        self._shape_of = np.full(ways, -1, dtype=np.int32)

    def draw(
        self,
        picture: NDArray[np.uint8],
        centres: NDArray[np.floating],
        heading_rad: NDArray[np.floating] | None,
        fill: NDArray[np.integer],
        table: tuple[slice, slice],
    ) -> None:
        """Draws into `picture`, [height, width, 4], but not beyond the rows and columns of `table`.

        `centres`: [robots, 2], pixels to the right and down of the upper left corner; NaN: nowhere.
        `heading_rad`: [robots], counter-clockwise from the right; None: no line to the front.
        `fill`: [robots], which of the fills.
        """
        pixels = picture.view(np.uint32).ravel()
        hiding = np.full(len(pixels), -1, dtype=np.int32)  # the robot in front
        width = picture.shape[1]
        offsets = self._rows * width + self._columns
        margin = int(self._rows.max())
        (low, high), (left, right) = ((part.start, part.stop) for part in table)
        here = np.flatnonzero(np.isfinite(centres).all(axis=1))
        scaled = np.floor(centres[here] * _PHASES).astype(np.int32)
        corner, phase = scaled // _PHASES, scaled % _PHASES
        turn = np.full(len(here), self._turns)
        if heading_rad is not None:
            turn = np.round(heading_rad[here] * self._turns / (2 * np.pi)).astype(int) % self._turns
        way = (fill[here].astype(int) * (self._turns + 1) + turn) * _PHASES**2
        way += phase[:, 1] * _PHASES + phase[:, 0]
        each = max(1, _AT_ONCE // len(self._rows))
        for first in range(0, len(here), each):
            some = slice(first, first + each)
            shapes = self._of_ways(way[some])
            column, row = corner[some].T[:, :, None]
            seen = shapes < _NOTHING
            inside = (column >= left + margin) & (column < right - margin)
            inside &= (row >= low + margin) & (row < high - margin)
            if not inside.all():
                columns, rows = column + self._columns, row + self._rows
                seen &= (columns >= left) & (columns < right) & (rows >= low) & (rows < high)
            places = row * width + column + offsets
            which = np.broadcast_to(here[some, None], places.shape)[seen]
            _paint((pixels, hiding), which, places[seen], shapes[seen])

    def _of_ways(self, ways: NDArray[np.int_]) -> NDArray[np.uint32]:
        """[ways, pixels of a shape]"""
        new = np.unique(ways[self._shape_of[ways] < 0])
        if len(new):
            if (len(self._shapes) + len(new)) * len(self._rows) > _MOST_KEPT:
                self._forget()
                new = np.unique(ways)
            self._shape_of[new] = len(self._shapes) + np.arange(len(new))
            self._shapes = np.concatenate([self._shapes, self._made(new)])
        return self._shapes[self._shape_of[ways]]

    def _made(self, ways: NDArray[np.int_]) -> NDArray[np.uint32]:
        rest, phase = np.divmod(ways[:, None], _PHASES**2)
        fill, turn = np.divmod(rest, self._turns + 1)
        down, right = ((part + 0.5) / _PHASES for part in np.divmod(phase, _PHASES))
        right, down = self._columns + 0.5 - right, self._rows + 0.5 - down
        away = np.hypot(right, down)
        line = _stroke(np.abs(away - self._radius), self._outline)
        heading = 2 * np.pi / self._turns * turn
        along = np.clip(right * np.cos(heading) - down * np.sin(heading), 0, self._radius)
        apart = np.hypot(right - along * np.cos(heading), down + along * np.sin(heading))
        line += (1 - line) * np.where(turn < self._turns, _stroke(apart, self._front), 0)
        disc = np.clip(self._radius + 0.5 - away, 0, 1) * (1 - line)
        parts = np.empty((*away.shape, 4), dtype=np.uint8)
        colours = self._fills[fill] * disc[..., None] + self._line_colour * line[..., None]
        parts[..., :3] = np.floor(colours + 0.5)
        parts[..., 3] = np.floor(255 * (1 - disc - line) + 0.5)
        return parts.view(np.uint32)[..., 0]


def _stroke(away: NDArray[np.float64], width: float) -> NDArray[np.float64]:
    """The share of a pixel, so far from the middle of a line, that the line covers."""
    return np.clip((1 + width) / 2 - away, 0, min(1, width))


def _paint(
    picture: tuple[NDArray[np.uint32], NDArray[np.int32]],
    robots: NDArray[np.intp],
    places: NDArray[np.int32],
    shapes: NDArray[np.uint32],
) -> None:
    """Draws what is wholly covered first; then edges, but for those that a later robot hides.

    `picture`: its pixels and the robot that hides others in each.
    """
    pixels, hiding = picture
    whole = shapes < _EDGE
    where = places[whole]
    pixels[where] = shapes[whole] | _SOLID
    hiding[where] = robots[whole]
    edge = np.flatnonzero(~whole)
    edge = edge[hiding[places[edge]] <= robots[edge]]
    where = places[edge]
    below = pixels[where].view(np.uint8).reshape(-1, 4).astype(np.uint16)
    above = shapes[edge].view(np.uint8).reshape(-1, 4)
    mixed = (below * above[:, 3:] + 127) // 255 + above
    pixels[where] = mixed.astype(np.uint8).view(np.uint32)[:, 0] | _SOLID
