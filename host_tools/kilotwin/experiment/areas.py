"""Places on the floor: circles, upright rectangles and polygons, in metres from the middle."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kilotwin.experiment import polygons
from kilotwin.experiment.polygons import Corner
from kilotwin.experiment.schema.experiment import Arena, Obstacle, Site
from kilotwin.experiment.schema.metric import Region
from kilotwin.experiment.schema.object import ObjectPart

# Sites may touch one another and the wall.
_TOUCH_M = 1e-9


@dataclass(frozen=True)
class Area:
    """A circle (width = height = diameter), a rectangle, or a polygon, by its box and corners."""

    circle: bool
    x: float
    y: float
    width: float
    height: float
    corners: tuple[Corner, ...] = ()

    @property
    def square_metres(self) -> float:
        """How large it is."""
        if self.corners:
            return polygons.square_metres(self.corners)
        return self.width * self.height * (math.pi / 4 if self.circle else 1)

    @property
    def outline(self) -> tuple[Corner, ...]:
        """The corners of a rectangle or polygon."""
        if self.corners or self.circle:
            return self.corners
        right, top = self.x + self.width / 2, self.y + self.height / 2
        left, bottom = self.x - self.width / 2, self.y - self.height / 2
        return (left, bottom), (right, bottom), (right, top), (left, top)


def polygon_of(corners: tuple[Corner, ...]) -> Area:
    """The area of a polygon."""
    (left, right), (low, high) = ((min(part), max(part)) for part in zip(*corners, strict=True))
    return Area(False, (left + right) / 2, (low + high) / 2, right - left, high - low, corners)


def disc(x: float, y: float, diameter: float) -> Area:
    """The area of a robot, say."""
    return Area(True, x, y, diameter, diameter)


def area_of(place: Arena | Obstacle | ObjectPart | Region | Site) -> Area:
    """The area of a site, of an obstacle, of a part or of the arena, whose keys are complete.

    A site that is drawn has none.
    """
    x, y = (0.0, 0.0) if isinstance(place, Arena) else place.centre_m or (0.0, 0.0)
    heading = place.heading_rad if isinstance(place, Obstacle | ObjectPart) else 0.0
    if place.shape == "circle":
        assert place.diameter_m is not None
        return disc(x, y, place.diameter_m)
    assert place.shape != "picture"
    if place.shape == "polygon":
        assert place.points_m is not None
        return polygon_of(_placed([(px, py) for px, py in place.points_m], x, y, heading))
    assert place.width_m is not None
    assert place.height_m is not None
    upright = Area(False, x, y, place.width_m, place.height_m)
    if heading == 0:
        return upright
    about_0 = Area(False, 0.0, 0.0, place.width_m, place.height_m)
    return polygon_of(_placed(about_0.outline, x, y, heading))


def _placed(
    corners: list[Corner] | tuple[Corner, ...], x: float, y: float, heading: float
) -> tuple[Corner, ...]:
    """Turned about (0, 0), then moved."""
    cos, sin = math.cos(heading), math.sin(heading)
    return tuple((x + cos * px - sin * py, y + sin * px + cos * py) for px, py in corners)


def placed(area: Area, x: float, y: float, heading: float) -> Area:
    """An area of a frame whose (0, 0) is at (x, y), turned by `heading`."""
    if area.circle:
        ((middle_x, middle_y),) = _placed([(area.x, area.y)], x, y, heading)
        return disc(middle_x, middle_y, area.width)
    return polygon_of(_placed(area.outline, x, y, heading))


def lies_inside(inner: Area, outer: Area) -> bool:
    """Whether all of `inner` is in `outer`."""
    if outer.corners:
        return _inside_polygon(inner, outer.corners)
    if outer.circle and not inner.circle:
        return all(
            math.hypot(x - outer.x, y - outer.y) <= outer.width / 2 + _TOUCH_M
            for x, y in inner.outline
        )
    away_x, away_y = abs(inner.x - outer.x), abs(inner.y - outer.y)
    if outer.circle:
        return math.hypot(away_x, away_y) + inner.width / 2 <= outer.width / 2 + _TOUCH_M
    return (
        away_x + inner.width / 2 <= outer.width / 2 + _TOUCH_M
        and away_y + inner.height / 2 <= outer.height / 2 + _TOUCH_M
    )


def _inside_polygon(inner: Area, outer: tuple[Corner, ...]) -> bool:
    if inner.circle:
        if not polygons.contains(outer, inner.x, inner.y):
            return False
        return polygons.edge_distance((inner.x, inner.y), outer) >= inner.width / 2 - _TOUCH_M
    outline = inner.outline
    if not polygons.contains(outer, *polygons.inner_point(outline)):
        return False
    if any(_well_inside(outline, corner) for corner in outer):
        return False
    return all(
        polygons.contains(outer, *corner) or polygons.edge_distance(corner, outer) <= _TOUCH_M
        for corner in outline
    ) and not _cross(outline, outer)


def _well_inside(outline: tuple[Corner, ...], point: Corner) -> bool:
    """Whether a point is inside, and not on the edge."""
    return polygons.contains(outline, *point) and polygons.edge_distance(point, outline) > _TOUCH_M


def _cross(one: tuple[Corner, ...], other: tuple[Corner, ...]) -> bool:
    """Whether edges cross, and not just meet."""
    return any(
        polygons.crossing(a, b)
        and all(
            polygons.distance(point, edge) > _TOUCH_M
            for points, edge in ((a, b), (b, a))
            for point in points
        )
        for a, b in itertools.product(polygons.edges(one), polygons.edges(other))
    )


def contains(area: Area, x: float, y: float) -> bool:
    """Whether a point is in it."""
    if area.circle:
        return math.hypot(x - area.x, y - area.y) <= area.width / 2
    in_box = abs(x - area.x) <= area.width / 2 and abs(y - area.y) <= area.height / 2
    return in_box and (not area.corners or polygons.contains(area.corners, x, y))


def inside(
    area: Area, x: NDArray[np.float64], y: NDArray[np.float64], slack: float = 0.0
) -> NDArray[np.bool_]:
    """Which points are in it, or no farther away than `slack`, along each axis for a rectangle."""
    half_x, half_y = area.width / 2 + slack, area.height / 2 + slack
    away_x, away_y = np.abs(x - area.x), np.abs(y - area.y)
    if area.circle:
        return np.asarray(away_x**2 + away_y**2 <= half_x**2)
    in_box = np.asarray((away_x <= half_x) & (away_y <= half_y))
    if area.corners:
        for index in zip(*np.nonzero(in_box), strict=True):
            point = (float(x[index]), float(y[index]))
            in_box[index] = (
                polygons.contains(area.corners, *point)
                or polygons.edge_distance(point, area.corners) <= slack
            )
    return in_box


def overlap(one: Area, other: Area) -> bool:
    """Whether they have more than a border in common."""
    if one.circle and not other.circle:
        one, other = other, one
    away_x, away_y = abs(one.x - other.x), abs(one.y - other.y)
    if one.circle:
        return math.hypot(away_x, away_y) < (one.width + other.width) / 2 - _TOUCH_M
    if one.corners or other.corners:
        return _overlap_polygon(one, other)
    if other.circle:
        gap_x, gap_y = max(away_x - one.width / 2, 0), max(away_y - one.height / 2, 0)
        return math.hypot(gap_x, gap_y) < other.width / 2 - _TOUCH_M
    return (
        away_x < (one.width + other.width) / 2 - _TOUCH_M
        and away_y < (one.height + other.height) / 2 - _TOUCH_M
    )


def _overlap_polygon(one: Area, other: Area) -> bool:
    """`one` has corners."""
    outline = one.outline
    if other.circle:
        middle = (other.x, other.y)
        near = polygons.edge_distance(middle, outline) < other.width / 2 - _TOUCH_M
        return near or polygons.contains(outline, *middle)
    if _cross(outline, other.outline):
        return True
    return any(
        _well_inside(a, point)
        for a, b in ((outline, other.outline), (other.outline, outline))
        for point in (*b, polygons.inner_point(b))
    )
