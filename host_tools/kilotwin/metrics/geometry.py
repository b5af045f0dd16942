"""Built-in metrics of where robots stand that SciPy computes.

SciPy takes half a second to load, so only those load it that need it; and they do when they are
made, since a run's worker, once it is confined, can load nothing.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]


def hull_area() -> Callable[[Points], float]:
    """The area of the convex hull; 0 of points on a line."""
    from scipy.spatial import ConvexHull, QhullError

    def area(points: Points) -> float:
        if len(points) < 3:
            return 0.0
        try:
            return float(ConvexHull(points).volume)  # in two dimensions
        except QhullError:
            return 0.0

    return area


def cluster_sizes(within_m: float) -> Callable[[Points], list[int]]:
    """How many robots each group has that is joined by gaps of so much at most."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    def sizes(points: Points) -> list[int]:
        number = len(points)
        if not number:
            return []
        pairs = KDTree(points).query_pairs(within_m, output_type="ndarray")
        near = (np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1]))
        _, labels = connected_components(coo_array(near, shape=(number, number)), directed=False)
        return [int(size) for size in np.bincount(labels)]

    return sizes
