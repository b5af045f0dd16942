"""Polygons are cut into convex pieces that cover them, without overlapping."""

import math
import random

import pytest

from kilotwin.experiment import polygons
from kilotwin.experiment.areas import lies_inside, overlap, polygon_of
from kilotwin.experiment.convex import MOST_CORNERS, convex_pieces, narrowest_m
from kilotwin.experiment.polygons import Corner

ELL = [(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)]
CROSS_X = [1, 2, 2, 3, 3, 2, 2, 1, 1, 0, 0, 1]
CROSS_Y = [0, 0, 1, 1, 2, 2, 3, 3, 2, 2, 1, 1]


def star(points: int, inner: float) -> list[Corner]:
    """Corners far out and near the middle, in turn."""
    return [
        (r * math.cos(math.pi * i / points), r * math.sin(math.pi * i / points))
        for i in range(2 * points)
        for r in [inner if i % 2 else 1.0]
    ]


def ragged(seed: int) -> list[Corner]:
    """A polygon with corners at random distances from a point."""
    chance = random.Random(seed)
    return [
        (r * math.cos(angle), r * math.sin(angle))
        for i in range(25)
        for r, angle in [(chance.uniform(0.2, 1), 2 * math.pi * i / 25)]
    ]


SHAPES = [
    [(0.0, 0.0), (1.0, 0.0), (0.5, 1.0)],
    ELL,
    [(float(x), float(y)) for x, y in zip(CROSS_X, CROSS_Y, strict=True)],
    star(5, 0.4),
    star(12, 0.9),
    [(math.cos(i * math.pi / 20), math.sin(i * math.pi / 20)) for i in range(40)],
    *(ragged(seed) for seed in range(12)),
]


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("corners", SHAPES)
def test_pieces_cover_a_polygon_and_do_not_overlap(
    corners: list[Corner], *, backwards: bool
) -> None:
    assert polygons.first_fault(corners, 1e-3) is None
    pieces = convex_pieces(corners[::-1] if backwards else corners)
    areas = [polygon_of(tuple(piece)) for piece in pieces]
    whole = polygon_of(tuple(corners))
    assert math.fsum(area.square_metres for area in areas) == pytest.approx(whole.square_metres)
    assert all(lies_inside(area, whole) for area in areas)
    assert not any(overlap(a, b) for i, a in enumerate(areas) for b in areas[:i])
    for piece in pieces:
        assert 3 <= len(piece) <= MOST_CORNERS
        assert all(_turn(*_three(piece, i)) > 0 for i in range(len(piece)))


def _three(piece: list[Corner], i: int) -> tuple[Corner, Corner, Corner]:
    return piece[i - 1], piece[i], piece[(i + 1) % len(piece)]


def _turn(a: Corner, b: Corner, c: Corner) -> float:
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def test_what_is_convex_stays_whole() -> None:
    octagon = [(math.cos(i * math.pi / 4), math.sin(i * math.pi / 4)) for i in range(8)]
    assert len(convex_pieces(octagon)) == 1
    assert len(convex_pieces(ELL)) == 2


def test_corners_on_a_straight_edge_are_left_out() -> None:
    square = [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.3)]
    (piece,) = convex_pieces(square)
    assert sorted(piece) == [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)]


def test_the_least_width_of_a_piece_is_found() -> None:
    assert narrowest_m([(0.0, 0.0), (3.0, 0.0), (3.0, 0.5), (0.0, 0.5)]) == pytest.approx(0.5)
    assert narrowest_m([(0.0, 0.0), (2.0, 0.0), (0.0, 2.0)]) == pytest.approx(math.sqrt(2))
