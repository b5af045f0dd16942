"""Robots smaller than a pixel: a pixel is drawn in the mean colour of the robots in it."""

import numpy as np
import pytest

from kilotwin.studies.plot.points import Points

FILLS = np.array([(0, 0, 0), (255, 0, 0), (0, 0, 254)], dtype=np.uint8)
TABLE = slice(1, 4), slice(2, 6)


@pytest.fixture
def picture() -> np.ndarray:
    """Grey, five rows of eight pixels."""
    return np.full((5, 8, 4), 90, dtype=np.uint8)


def drawn(picture: np.ndarray, robots: list[tuple[float, float, int]]) -> np.ndarray:
    """The picture's colours with robots at (right, down) in one of the fills."""
    right, down, fill = (np.array(column) for column in zip(*robots, strict=True))
    Points(FILLS).draw(picture, np.column_stack([right, down]), None, fill, TABLE)
    return picture[..., :3]


def test_a_pixel_has_the_mean_colour_of_the_robots_in_it(picture: np.ndarray) -> None:
    colours = drawn(picture, [(2.1, 1.9, 1), (2.9, 1.1, 2), (5.5, 3.5, 1), (5.5, 3.6, 1)])
    assert colours[1, 2].tolist() == [128, 0, 127]
    assert colours[3, 5].tolist() == [255, 0, 0]
    assert np.count_nonzero((colours != 90).any(axis=2)) == 2


@pytest.mark.parametrize(
    ("right", "down"), [(1.9, 2), (6.0, 2), (3, 0.9), (3, 4.0), (np.nan, 2), (3, np.nan)]
)
def test_nothing_is_drawn_beyond_the_table(picture: np.ndarray, right: float, down: float) -> None:
    assert (drawn(picture, [(right, down, 1)]) == 90).all()
