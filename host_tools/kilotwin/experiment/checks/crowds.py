"""Which of many places are near one another, without a look at each pair."""

import numpy as np
from numpy.typing import NDArray

# So many places fit into a square as wide as they are apart, with room to spare.
_MOST_IN_A_SQUARE = 4
# A square, and those after it that touch it: each pair of squares once.
_NEAR = ((0, 0), (0, 1), (1, -1), (1, 0), (1, 1))


def crowded(places: NDArray[np.float64], apart_m: float) -> NDArray[np.bool_]:
    """Those of places, [k, 2] in metres, that may have another one nearer than `apart_m`: all that
    have, and all there are where a square of that width holds more than fit.

    Places are within 10 million times `apart_m` of (0, 0).
    """
    near = np.zeros(len(places), np.bool_)
    if len(places) < 2:
        return near
    squares = np.floor(places / apart_m).astype(np.int64)
    squares -= squares.min(axis=0)
    rows = int(squares[:, 1].max()) + 3  # that none above touches one below
    keys = squares[:, 0] * rows + squares[:, 1]
    order = np.argsort(keys, kind="stable")
    keys, (x, y) = keys[order], places[order].T
    most = np.searchsorted(keys, keys, "right") - np.arange(len(keys))
    if most.max() > _MOST_IN_A_SQUARE:
        return ~near
    for columns_on, rows_on in _NEAR:
        wanted = keys + (columns_on * rows + rows_on)
        first = np.searchsorted(keys, wanted, "left")
        for number in range(_MOST_IN_A_SQUARE):
            other = np.minimum(first + number, len(keys) - 1)
            pair = (keys[other] == wanted) & (other != np.arange(len(keys)))
            pair &= (x - x[other]) ** 2 + (y - y[other]) ** 2 < apart_m**2
            near[order[pair]] = True
            near[order[other[pair]]] = True
    return near
