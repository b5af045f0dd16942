"""Circles, rectangles and polygons on the floor."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kilotwin.experiment import polygons
from kilotwin.experiment.areas import (
    Area,
    area_of,
    contains,
    disc,
    inside,
    lies_inside,
    overlap,
    polygon_of,
)
from kilotwin.experiment.schema.experiment import Obstacle

ROUND = Area(True, 0, 0, 4, 4)
SQUARE = Area(False, 0, 0, 4, 4)
# 4 x 4 without its upper right quarter.
ELL = polygon_of(((-2, -2), (2, -2), (2, 0), (0, 0), (0, 2), (-2, 2)))
BOX = polygon_of(SQUARE.outline)


@pytest.mark.parametrize(
    ("inner", "outer", "inside"),
    [
        (Area(True, 1, 0, 2, 2), ROUND, True),  # touches the wall
        (Area(True, 1.01, 0, 2, 2), ROUND, False),
        (Area(True, 1, 1, 2, 2), SQUARE, True),
        (Area(True, 1, 1.01, 2, 2), SQUARE, False),
        (Area(False, 0, 0, 2.8, 2.8), ROUND, True),
        (Area(False, 0, 0, 2.9, 2.9), ROUND, False),  # its corners stick out
        (Area(False, -1, 1, 2, 2), SQUARE, True),
        (Area(False, -1, 1, 2.1, 2), SQUARE, False),
        (disc(-1, -1, 2), ELL, True),
        (disc(-0.5, -0.5, 1.5), ELL, False),  # over the corner that sticks in
        (disc(1, 1, 0.5), ELL, False),
        (Area(False, 0, -1, 4, 2), ELL, True),  # touches walls all around
        (Area(False, 0, -1, 4, 2.1), ELL, False),
        (Area(False, 0, 0, 3, 3), ELL, False),
        (polygon_of(((-2, 2), (-2, -2), (2, -2))), ELL, True),  # touches the corner
        (polygon_of(((-2, 2), (-2, -2), (2, -1.9))), ELL, False),
        (ELL, SQUARE, True),
        (ELL, ROUND, False),
        (ELL, ELL, True),
        (SQUARE, BOX, True),
        (BOX, ELL, False),
    ],
)
def test_inside_is_inside(inner: Area, outer: Area, inside: bool) -> None:
    assert lies_inside(inner, outer) is inside


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (Area(True, 0, 0, 2, 2), Area(True, 2, 0, 2, 2), False),
        (Area(True, 0, 0, 2, 2), Area(True, 1.99, 0, 2, 2), True),
        (Area(False, 0, 0, 2, 2), Area(True, 2, 0, 2, 2), False),
        (Area(False, 0, 0, 2, 2), Area(True, 1.9, 0, 2, 2), True),
        (Area(False, 0, 0, 2, 2), Area(True, 1.8, 1.8, 2, 2), False),  # beside the corner
        (Area(False, 0, 0, 2, 2), Area(True, 0, 0, 0.1, 0.1), True),  # within
        (Area(False, 0, 0, 2, 2), Area(False, 2, 0, 2, 2), False),
        (Area(False, 0, 0, 2, 2), Area(False, 1.9, 1.9, 2, 2), True),
        (Area(False, 0, 0, 2, 2), Area(False, 1.9, 2, 2, 2), False),
        (ELL, disc(1, 1, 2), False),  # in the notch
        (ELL, disc(1, 1, 2.1), True),
        (ELL, disc(-1, 1, 0.1), True),  # within
        (ELL, Area(False, 1, 1, 2, 2), False),
        (ELL, Area(False, 1, 1, 2.1, 2), True),
        (BOX, BOX, True),
        (BOX, Area(False, 0, 0, 8, 0.1), True),  # goes right through
        (BOX, polygon_of(((2, 0), (4, -1), (4, 1))), False),  # touches with its tip
    ],
)
def test_overlap_is_more_than_a_border(one: Area, other: Area, expected: bool) -> None:
    assert overlap(one, other) is expected
    assert overlap(other, one) is expected


def test_areas_are_areas() -> None:
    assert ROUND.square_metres == pytest.approx(4 * math.pi)
    assert SQUARE.square_metres == 16


SIZES = st.floats(0.1, 3)
PLACES = st.builds(
    lambda circle, x, y, width, height: Area(circle, x, y, width, width if circle else height),
    st.booleans(),
    st.floats(-3, 3),
    st.floats(-3, 3),
    SIZES,
    SIZES,
)


def holds(area: Area, x: float, y: float) -> bool:
    """Whether the point is inside, and not just at the border."""
    half_width, half_height = area.width / 2 - 1e-6, area.height / 2 - 1e-6
    if area.circle:
        return math.hypot(x - area.x, y - area.y) < half_width
    return abs(x - area.x) < half_width and abs(y - area.y) < half_height


@given(PLACES, PLACES, st.floats(-4, 4), st.floats(-4, 4))
def test_a_point_in_both_means_overlap(one: Area, other: Area, x: float, y: float) -> None:
    if holds(one, x, y) and holds(other, x, y):
        assert overlap(one, other)


def test_a_turned_rectangle_is_where_it_is_turned_to() -> None:
    plate = Obstacle(
        shape="rectangle",
        centre_m=[1.0, 0.0],
        width_m=2.0,
        height_m=0.1,
        heading_rad=math.pi / 2,
        blocks_light=False,
    )
    area = area_of(plate)
    assert contains(area, 1.0, 0.9)
    assert not contains(area, 1.9, 0.0)
    assert area.square_metres == pytest.approx(0.2)


def test_points_of_a_polygon_are_turned_and_moved() -> None:
    wedge = Obstacle(
        shape="polygon",
        centre_m=[3.0, 0.0],
        points_m=[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
        heading_rad=math.pi,
        blocks_light=False,
    )
    assert contains(area_of(wedge), 2.8, -0.2)
    assert not contains(area_of(wedge), 3.2, 0.2)


def test_many_points_are_inside_as_each_by_itself() -> None:
    x, y = np.meshgrid(np.linspace(-3.01, 3.02, 61), np.linspace(-3.03, 3.04, 53))
    for area in (ROUND, SQUARE, ELL):
        each = [contains(area, *point) for point in zip(x.flat, y.flat, strict=True)]
        assert inside(area, x, y).flatten().tolist() == each


@pytest.mark.parametrize(
    ("corners", "fault"),
    [
        (ELL.corners, None),
        (ELL.corners[::-1], None),
        (((0, 0), (2, 2), (2, 0), (0, 2)), (0, 2)),
        (((0, 0), (2, 0), (2, 0), (0, 2)), (1, 1)),
        (((0, 0), (4, 0), (2, 0), (2, 2)), (0, 1)),  # back on itself
        (((0, 0), (4, 0), (4, 4), (2, 0.0005), (0, 4)), (0, 2)),  # a tip on an edge
    ],
)
def test_outlines_that_meet_themselves_are_found(
    corners: tuple[tuple[float, float], ...], fault: tuple[int, int] | None
) -> None:
    assert polygons.first_fault(corners, 0.001) == fault


def test_the_inner_point_of_a_polygon_is_inside() -> None:
    star = [(math.cos(i) * (1 + i % 3), math.sin(i) * (1 + i % 3)) for i in range(6)]
    for corners in (ELL.corners, star):
        assert polygons.contains(corners, *polygons.inner_point(corners))
