"""Circles and rectangles on the floor."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kilotwin.experiment.areas import Area, lies_inside, overlap

ROUND = Area(True, 0, 0, 4, 4)
SQUARE = Area(False, 0, 0, 4, 4)


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
