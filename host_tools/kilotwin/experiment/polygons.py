"""Simple polygons: corners as (x, y) in metres, in either order, no edge crossing another."""

import itertools
import math
from collections.abc import Iterator, Sequence

Corner = tuple[float, float]
Corners = Sequence[Corner]
Edge = tuple[Corner, Corner]


def edges(corners: Corners) -> Iterator[Edge]:
    """In their order, the last one back to the first corner."""
    return zip(corners, [*corners[1:], corners[0]], strict=True)


def square_metres(corners: Corners) -> float:
    """How large a polygon is."""
    return abs(math.fsum(a[0] * b[1] - a[1] * b[0] for a, b in edges(corners))) / 2


def distance(point: Corner, edge: Edge) -> float:
    """From a point to an edge, its ends included."""
    (x, y), ((ax, ay), (bx, by)) = point, edge
    along_x, along_y = bx - ax, by - ay
    square = along_x**2 + along_y**2
    part = ((x - ax) * along_x + (y - ay) * along_y) / square if square else 0.0
    part = min(max(part, 0.0), 1.0)
    return math.hypot(x - ax - part * along_x, y - ay - part * along_y)


def edge_distance(point: Corner, corners: Corners) -> float:
    """From a point to the nearest edge, from either side."""
    return min(distance(point, edge) for edge in edges(corners))


def contains(corners: Corners, x: float, y: float) -> bool:
    """Whether a point is inside, by even-odd; on an edge it may be either."""
    inside = False
    for (ax, ay), (bx, by) in edges(corners):
        if (ay > y) != (by > y):
            turn = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
            inside ^= turn > 0 if by > ay else turn < 0
    return inside


def _turn(a: Corner, b: Corner, c: Corner) -> float:
    """Above 0 if c is on the left of those who go from a to b."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def crossing(one: Edge, other: Edge) -> bool:
    """Whether two edges cross, each going through the other to its far side."""
    (a, b), (c, d) = one, other
    return (_turn(a, b, c) > 0) != (_turn(a, b, d) > 0) and (_turn(c, d, a) > 0) != (
        _turn(c, d, b) > 0
    )


def first_fault(corners: Corners, least_m: float) -> tuple[int, int] | None:
    """Two edges, by their numbers from 0, that make it none: they cross, or come nearer to one
    another than `least_m`. An edge shorter than that is given with itself."""
    listed = list(edges(corners))
    for i, (begin, end) in enumerate(listed):
        if math.dist(begin, end) < least_m:
            return i, i
    for i, j in itertools.combinations(range(len(listed)), 2):
        one, other = listed[i], listed[j]
        if j - i == 1 or j - i == len(listed) - 1:
            before, after = (one, other) if j - i == 1 else (other, one)
            if min(distance(before[0], after), distance(after[1], before)) < least_m:
                return i, j
        elif crossing(one, other) or _apart(one, other) < least_m:
            return i, j
    return None


def _apart(one: Edge, other: Edge) -> float:
    """Between two edges that do not cross."""
    ends = [distance(point, other) for point in one] + [distance(point, one) for point in other]
    return min(ends)


def inner_point(corners: Corners) -> Corner:
    """Some point inside, off all edges."""
    heights = sorted({y for _, y in corners})
    y = (heights[0] + heights[1]) / 2
    across = sorted(
        ax + (bx - ax) * (y - ay) / (by - ay)
        for (ax, ay), (bx, by) in edges(corners)
        if (ay > y) != (by > y)
    )
    return (across[0] + across[1]) / 2, y
