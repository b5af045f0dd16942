"""Robots of a video: as large as they are, smooth at their edges, the later ones in front."""

import numpy as np
import pytest

from kilotwin.studies.plot.discs import Discs

GREY = np.array([64, 64, 64], dtype=np.uint8)
FILLS = np.array([[200, 0, 0], [0, 0, 200]], dtype=np.uint8)
ALL = (slice(0, 60), slice(0, 60))


def white() -> np.ndarray:
    """60 x 60 pixels."""
    return np.full((60, 60, 4), 255, dtype=np.uint8)


@pytest.mark.parametrize("radius", [1.5, 4.0, 20.0])
@pytest.mark.parametrize("at", [(30.0, 30.0), (30.3, 29.6)])
def test_a_disc_covers_its_area_around_its_middle(radius: float, at: tuple[float, float]) -> None:
    picture = white()
    black = np.zeros((1, 3), dtype=np.uint8)
    discs = Discs(radius, (0.0, 0.0), GREY, black)
    discs.draw(picture, np.array([at]), None, np.zeros(1, dtype=np.uint8), ALL)
    cover = 1 - picture[..., 0] / 255
    assert cover.sum() == pytest.approx(np.pi * radius**2, rel=0.05)
    rows, columns = np.mgrid[0:60, 0:60] + 0.5
    assert (cover * columns).sum() / cover.sum() == pytest.approx(at[0], abs=0.15)
    assert (cover * rows).sum() / cover.sum() == pytest.approx(at[1], abs=0.15)
    assert (picture[..., 3] == 255).all()


def test_the_line_to_the_front_goes_where_the_robot_looks() -> None:
    picture = white()
    discs = Discs(10.0, (1.0, 2.0), GREY, FILLS)
    up = np.array([np.pi / 2])
    discs.draw(picture, np.array([[30.0, 30.0]]), up, np.zeros(1, dtype=np.uint8), ALL)
    assert (picture[24, 30, :3] == GREY).all()
    for row, column in ((36, 30), (30, 24), (30, 36)):
        assert (picture[row, column, :3] == FILLS[0]).all()


def test_of_two_that_overlap_the_later_is_whole() -> None:
    alone, both = white(), white()
    discs = Discs(8.0, (1.0, 1.0), GREY, FILLS)
    centres = np.array([[28.0, 30.2], [32.4, 30.0], [np.nan, 3.0]])
    fill = np.array([0, 1, 1], dtype=np.uint8)
    discs.draw(alone, centres[1:2], np.zeros(1), fill[1:2], ALL)
    discs.draw(both, centres, np.zeros(3), fill, ALL)
    rows, columns = np.mgrid[0:60, 0:60] + 0.5
    inside = np.hypot(columns - 32.4, rows - 30.0) < 7.5
    assert (both[inside] == alone[inside]).all()
    assert (both[30, 21, :3] == FILLS[0]).all()


def test_nothing_is_drawn_beyond_the_table() -> None:
    picture = white()
    table = (slice(10, 40), slice(5, 50))
    discs = Discs(6.0, (1.0, 1.0), GREY, FILLS)
    centres = np.array([[5.0, 10.0], [50.0, 40.0], [25.0, 25.0], [-900.0, 2e3]])
    discs.draw(picture, centres, np.zeros(4), np.zeros(4, dtype=np.uint8), table)
    assert (picture[12, 7, :3] == FILLS[0]).all()
    picture[table] = 255
    assert (picture == 255).all()
