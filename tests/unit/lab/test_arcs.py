"""Rates of turning from the cells that a robot was seen over."""

import math

import numpy as np
import pytest

from kilotwin.table.lab.arcs import FEWEST_POINTS, PIECE_S, Point, drift_of, pieces_of

CELL_M = 0.05
SPEED = 0.0135


def seen(at_s: float, x: float, y: float) -> Point:
    """As the middle of a cell."""
    return Point(at_s, *((math.floor(part / CELL_M) + 0.5) * CELL_M for part in (x, y)))


def arc(rate: float, seconds: float, every_s: float = 3.0, speed: float = SPEED) -> list[Point]:
    """A robot that turns at this rate all the time."""
    points = []
    for at_s in np.arange(0.0, seconds, every_s):
        phase = rate * at_s
        along = at_s * np.sinc(phase / np.pi)
        aside = at_s * np.sinc(phase / 2 / np.pi) * math.sin(phase / 2)
        points.append(seen(float(at_s), 0.513 + speed * along, 0.507 + speed * aside))
    return points


@pytest.mark.parametrize("rate", [-0.2, -0.1, -0.03, 0.0, 0.05, 0.12, 0.25])
def test_an_arc_is_found_among_cells(rate: float) -> None:
    drift = drift_of([arc(rate, 105)], SPEED, 0.003)
    assert drift is not None
    assert abs(drift.turn_rad_s - rate) < 0.02
    assert abs(drift.turn_rad_s - rate) < 2.5 * drift.turn_sd
    assert drift.refused == 0
    assert abs(drift.speed_m_s - SPEED) < 0.003


def test_a_stray_point_does_little() -> None:
    track = arc(0.1, 105)
    track[7] = Point(track[7].at_s, track[7].x_m + 0.15, track[7].y_m)
    drift = drift_of([track], SPEED, 0.003)
    assert drift is not None
    assert abs(drift.turn_rad_s - 0.1) < 0.025


def test_a_robot_that_was_carried_about_is_not_believed() -> None:
    rng = np.random.default_rng(1)
    track = [Point(3.0 * i, *rng.uniform(0, 1, 2)) for i in range(30)]
    assert drift_of([track], SPEED, 0.003) is None


def test_more_pieces_tell_it_better() -> None:
    short, long = drift_of([arc(0.1, 36)], SPEED, 0.003), drift_of([arc(0.1, 180)], SPEED, 0.003)
    assert short is not None
    assert long is not None
    assert long.pieces > short.pieces
    assert long.turn_sd < 0.6 * short.turn_sd


def test_a_robot_seen_too_seldom_is_not_measured() -> None:
    assert drift_of([], SPEED, 0.003) is None
    assert drift_of([[]], SPEED, 0.003) is None
    assert drift_of([arc(0.1, 90, every_s=20)], SPEED, 0.003) is None
    assert drift_of([arc(0.1, 9)], SPEED, 0.003) is None


def test_pieces_have_points_and_length_enough() -> None:
    for piece in pieces_of(arc(0.1, 100)):
        assert len(piece) >= FEWEST_POINTS
        assert PIECE_S / 2 <= piece[-1].at_s - piece[0].at_s <= 1.5 * PIECE_S
