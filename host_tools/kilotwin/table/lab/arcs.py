"""How fast a robot turns and drives while both motors run, from the cells that it was seen over.

A robot whose motors differ walks in an arc. For a given rate of turning, an arc through points in
time is a linear least-squares problem in its place and its velocity, so that every rate on a fine
grid is tried: no start value, no local minimum. The likelihoods of short pieces of a track are
multiplied: within a piece a robot's heading strays little from the arc, over minutes it strays far.

Pure. Units: m, s, rad.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PIECE_S = 35.0
"""The length of a piece: longer ones tell the rate better, until the heading has strayed."""
FEWEST_POINTS = 4
# Cells are 5 cm wide, and a cell hears a robot from 4.5 cm: standard deviation of one coordinate.
_POINT_SD_M = 0.02
# Beyond so many of these a point is a stray one: it counts linearly (Huber).
_STRAY = 1.5
# Pieces that no arc explains better: the robot was pushed, or stood in another's way.
_WORST_RMS_M = 0.04
# Heading strays by so much in a second: motor noise of 16 % a second on two motors
# (hardware.md 2), at 0.54 rad/s a motor. A piece's mean rate strays by this over the root of its
# length; 6/5 since an arc weighs the middle of a piece more.
_STRAYING_RAD = 0.12
_RATES = np.linspace(-0.6, 0.6, 241)


@dataclass(frozen=True)
class Point:
    """A robot was received by a cell: its middle, and when."""

    at_s: float
    x_m: float
    y_m: float


@dataclass(frozen=True)
class Drift:
    """How a robot drives: positive turns are counter-clockwise. `sd` are standard deviations."""

    turn_rad_s: float
    turn_sd: float
    speed_m_s: float
    speed_sd: float
    pieces: int
    refused: int
    """Pieces that no arc explains."""


def pieces_of(leg: Sequence[Point], piece_s: float = PIECE_S) -> Iterator[Sequence[Point]]:
    """A leg cut into pieces of one length, at least half of `piece_s`, with points enough."""
    if not leg:
        return
    count = max(1, round((leg[-1].at_s - leg[0].at_s) / piece_s))
    length = (leg[-1].at_s - leg[0].at_s) / count
    if length < piece_s / 2:
        return
    for number in range(count):
        begin = leg[0].at_s + number * length
        piece = [point for point in leg if begin - 1e-6 <= point.at_s <= begin + length + 1e-6]
        if len(piece) >= FEWEST_POINTS and piece[-1].at_s - piece[0].at_s >= piece_s / 2:
            yield piece


def drift_of(legs: Sequence[Sequence[Point]], speed_m_s: float, speed_sd: float) -> Drift | None:
    """The drift of a robot that drove these legs at the same duties; None without a good piece.

    `speed_m_s` is what is expected of it: a robot that circles within a cell shows no speed.
    """
    log_likelihood = np.zeros_like(_RATES)
    speeds: list[tuple[Array, Array]] = []
    taken = refused = 0
    for piece in (piece for leg in legs for piece in pieces_of(leg)):
        loss, speed, rms = _arcs(piece)
        if rms.min() > _WORST_RMS_M:
            refused += 1
            continue
        loss = loss + ((speed - speed_m_s) / speed_sd) ** 2
        duration = piece[-1].at_s - piece[0].at_s
        log_likelihood += _strayed(-loss / 2, duration)
        speeds.append((loss, speed))
        taken += 1
    if taken == 0:
        return None
    weight = np.exp(log_likelihood - log_likelihood.max())
    weight /= weight.sum()
    rate = float(weight @ _RATES)
    sd = math.sqrt(float(weight @ (_RATES - rate) ** 2) + (_RATES[1] - _RATES[0]) ** 2 / 12)
    means, precision = 0.0, 0.0
    for loss, speed in speeds:
        near = np.exp(-(loss - loss.min()) / 2) * weight
        near = near / near.sum() if near.sum() > 0 else weight
        means += float(near @ speed)
        precision += 1
    return Drift(rate, sd, means / precision, speed_sd / math.sqrt(precision), taken, refused)


def _arcs(piece: Sequence[Point]) -> tuple[Array, Array, Array]:
    """For each of _RATES: the loss in squared standard deviations, the speed, and the rms error."""
    t = np.array([point.at_s for point in piece])
    t = t - (t[0] + t[-1]) / 2
    x = np.array([point.x_m for point in piece])
    y = np.array([point.y_m for point in piece])
    phase = _RATES[:, None] * t
    # sin(w t) / w and (1 - cos(w t)) / w, right at 0 too.
    along = t * np.sinc(phase / np.pi)
    aside = t * np.sinc(phase / 2 / np.pi) * np.sin(phase / 2)
    one, nil = np.ones_like(phase), np.zeros_like(phase)
    rows = np.concatenate(
        [np.stack([one, nil, along, -aside], -1), np.stack([nil, one, aside, along], -1)], axis=1
    )
    target = np.concatenate([x, y])
    weights = np.ones((len(_RATES), len(target)))
    for _ in range(3):
        weighted = rows * weights[:, :, None]
        normal = np.swapaxes(weighted, 1, 2) @ rows + 1e-9 * np.eye(4)
        solution = np.linalg.solve(normal, (np.swapaxes(weighted, 1, 2) @ target)[:, :, None])
        error = (target - (rows @ solution)[:, :, 0]) / _POINT_SD_M
        size = np.abs(error)
        weights = np.minimum(1.0, _STRAY / np.maximum(size, 1e-9))
    loss = np.where(size <= _STRAY, error**2, 2 * _STRAY * size - _STRAY**2).sum(axis=1)
    speed = np.hypot(solution[:, 2, 0], solution[:, 3, 0])
    rms = np.sqrt((error**2).mean(axis=1)) * _POINT_SD_M * math.sqrt(2)
    return loss, speed, rms


def _strayed(log_likelihood: Array, duration: float) -> Array:
    """The likelihood of the track's rate, of which a piece's own rate strays."""
    sd = _STRAYING_RAD * math.sqrt(1.2 / duration)
    step = _RATES[1] - _RATES[0]
    reach = math.ceil(4 * sd / step)
    kernel = np.exp(-((np.arange(-reach, reach + 1) * step / sd) ** 2) / 2)
    likelihood = np.exp(log_likelihood - log_likelihood.max())
    spread = np.convolve(likelihood, kernel / kernel.sum(), mode="same")
    return np.log(np.maximum(spread[: len(_RATES)], 1e-30))
