"""Places on the floor: circles and upright rectangles, in metres from the arena's middle."""

import math
from dataclasses import dataclass

from kilotwin.experiment.schema import Arena, Site

# Sites may touch one another and the wall.
_TOUCH_M = 1e-9


@dataclass(frozen=True)
class Area:
    """A circle (width = height = diameter) or a rectangle."""

    circle: bool
    x: float
    y: float
    width: float
    height: float

    @property
    def square_metres(self) -> float:
        """How large it is."""
        return self.width * self.height * (math.pi / 4 if self.circle else 1)


def area_of(place: Arena | Site) -> Area:
    """The area of a site or of the arena, whose keys are complete."""
    x, y = place.centre_m if isinstance(place, Site) else (0.0, 0.0)
    if place.shape == "circle":
        assert place.diameter_m is not None
        return Area(True, x, y, place.diameter_m, place.diameter_m)
    assert place.width_m is not None
    assert place.height_m is not None
    return Area(False, x, y, place.width_m, place.height_m)


def lies_inside(inner: Area, outer: Area) -> bool:
    """Whether all of `inner` is in `outer`, which is centred at (0, 0)."""
    reach_x = abs(inner.x) + inner.width / 2
    reach_y = abs(inner.y) + inner.height / 2
    if not outer.circle:
        return reach_x <= outer.width / 2 + _TOUCH_M and reach_y <= outer.height / 2 + _TOUCH_M
    if inner.circle:
        return math.hypot(inner.x, inner.y) + inner.width / 2 <= outer.width / 2 + _TOUCH_M
    return math.hypot(reach_x, reach_y) <= outer.width / 2 + _TOUCH_M


def contains(area: Area, x: float, y: float) -> bool:
    """Whether a point is in it."""
    if area.circle:
        return math.hypot(x - area.x, y - area.y) <= area.width / 2
    return abs(x - area.x) <= area.width / 2 and abs(y - area.y) <= area.height / 2


def overlap(one: Area, other: Area) -> bool:
    """Whether they have more than a border in common."""
    if one.circle and not other.circle:
        one, other = other, one
    away_x, away_y = abs(one.x - other.x), abs(one.y - other.y)
    if one.circle:
        return math.hypot(away_x, away_y) < (one.width + other.width) / 2 - _TOUCH_M
    if other.circle:
        gap_x, gap_y = max(away_x - one.width / 2, 0), max(away_y - one.height / 2, 0)
        return math.hypot(gap_x, gap_y) < other.width / 2 - _TOUCH_M
    return (
        away_x < (one.width + other.width) / 2 - _TOUCH_M
        and away_y < (one.height + other.height) / 2 - _TOUCH_M
    )
