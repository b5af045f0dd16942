"""Simple polygons cut into convex pieces of few corners, as the contact engine takes them."""

import itertools
import math

from kilotwin.experiment import polygons
from kilotwin.experiment.polygons import Corner, Corners

MOST_CORNERS = 8
_STRAIGHT = 1e-6  # sine of the angle at a corner that is none

Piece = list[Corner]


def convex_pieces(corners: Corners) -> list[Piece]:
    """Pieces that cover a simple polygon without overlapping, each convex and counter-clockwise.

    Their corners are among the polygon's. Takes the cube of the number of corners.
    """
    outline = list(corners)
    if sum(a[0] * b[1] - a[1] * b[0] for a, b in polygons.edges(outline)) < 0:
        outline.reverse()
    return _joined(_triangles(_without_straight(outline)))


def narrowest_m(piece: Piece) -> float:
    """The least width of a convex piece, over all directions."""
    return min(
        max(_sine(a, b, point) * math.dist(a, point) for point in piece if point not in (a, b))
        for a, b in polygons.edges(piece)
    )


def _sine(a: Corner, b: Corner, c: Corner) -> float:
    """Sine of the angle at `a`, from `b` to `c`, above 0 counter-clockwise."""
    turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return turn / (math.dist(a, b) * math.dist(a, c))


def _at(outline: Piece, i: int) -> tuple[Corner, Corner, Corner]:
    """A corner between the ones before and after it."""
    return outline[i - 1], outline[i], outline[(i + 1) % len(outline)]


def _turns_left(outline: Piece, i: int) -> bool:
    before, corner, after = _at(outline, i)
    return -_sine(corner, before, after) > _STRAIGHT


def _without_straight(outline: Piece) -> Piece:
    """Without the corners at which the outline goes straight on."""
    return [
        corner
        for i, corner in enumerate(outline)
        if abs(_sine(corner, *(_at(outline, i)[k] for k in (0, 2)))) > _STRAIGHT
    ]


def _triangles(outline: Piece) -> list[Piece]:
    """Cuts ears off, the fullest first, so that few slivers are left."""
    left, cut = list(outline), []
    while len(left) > 3:
        ears = [i for i in range(len(left)) if _is_ear(left, i)]
        best = max(ears, key=lambda i: narrowest_m(list(_at(left, i))))
        cut.append(list(_at(left, best)))
        left = _without_straight(left[:best] + left[best + 1 :])
    return [*cut, left] if len(left) == 3 else cut


def _is_ear(outline: Piece, i: int) -> bool:
    """Whether the triangle at a corner lies inside, with no other corner in it or at its edges."""
    if not _turns_left(outline, i):
        return False
    triangle = list(_at(outline, i))
    return not any(
        all(_sine(a, b, point) >= 0 for a, b in polygons.edges(triangle))
        for point in outline
        if point not in triangle
    )


def _joined(pieces: list[Piece]) -> list[Piece]:
    """Pieces with an edge in common become one, as long as it is convex and has few corners."""
    while True:
        for one, other in itertools.combinations(pieces, 2):
            both = _union(one, other)
            if both is not None:
                pieces = [piece for piece in pieces if piece not in (one, other)] + [both]
                break
        else:
            return pieces


def _union(one: Piece, other: Piece) -> Piece | None:
    """The convex polygon that two pieces make; None if they do not."""
    for i, j in itertools.product(range(len(one)), range(len(other))):
        if one[i] == other[j] and one[(i + 1) % len(one)] == other[j - 1]:
            # Round `one` from the edge's end to its begin, then round `other` between the two.
            around = [one[(i + 1 + k) % len(one)] for k in range(len(one))]
            around += [other[(j + 1 + k) % len(other)] for k in range(len(other) - 2)]
            both = _without_straight(around)
            convex = all(_turns_left(both, k) for k in range(len(both)))
            return both if convex and len(both) <= MOST_CORNERS else None
    return None
