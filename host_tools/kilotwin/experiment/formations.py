"""Formations: robots of one kind that start together, each with a pose."""

import itertools
import math
import random
from collections.abc import Callable, Iterator

from kilotwin.experiment.schema.experiment import ExperimentSchema, Robots
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.schema.start import Formation
from kilotwin.experiment.toml_lines import KeyPath

_PITCH = 2.0
"""Distance of neighbours in diameters of a robot, where a formation says none; in a pile _PILE."""
_PILE = 1.1
_GAP_M = 0.0005  # left between robots of a pile, and of a disc
_TRIES = 10_000

Chance = Callable[[], float]
Place = tuple[float, float]


class StartError(Exception):
    """A kind of robots cannot start as it says."""

    def __init__(self, index: int, key: str, what: str) -> None:
        super().__init__(what)
        self.path: KeyPath = ("robots", index, key)


def in_formation(keys: ExperimentSchema) -> ExperimentSchema:
    """The same, with poses in place of formations; StartError names the key."""
    if keys.robots is None:
        return keys
    diameter = 2 * PROFILES[keys.swarm.profile].radius_m
    kinds = [_placed(kind, index, keys.seed, diameter) for index, kind in enumerate(keys.robots)]
    return keys.model_copy(update={"robots": kinds})


def _placed(kind: Robots, index: int, seed: int, diameter: float) -> Robots:
    if kind.columns is not None:
        what = "columns are of a file: name one by poses, or leave them out"
        raise StartError(index, "columns", what)
    if kind.formation is None:
        return kind
    if kind.poses is not None:
        raise StartError(index, "formation", "these robots have poses too; keep one of them")
    pitch = pitch_of(kind.formation, diameter)
    if pitch < diameter:
        what = f"pitch_m is {pitch:g}; a robot is {diameter:g} m wide: take that or more"
        raise StartError(index, "formation", what)
    # Only random() of Python's generator is the same for ever.
    chance = random.Random(f"formation {index} {seed}").random
    poses = poses_of(kind.formation, kind.count, diameter, chance)
    if poses is None:
        what = f"{kind.count} robots find no room in that disc; make pitch_m more than {pitch:g}"
        raise StartError(index, "formation", what)
    return kind.model_copy(update={"poses": poses, "formation": None})


def poses_of(
    formation: Formation, count: int, diameter: float, chance: Chance
) -> list[list[float]] | None:
    """`count` poses, [x_m, y_m, heading_rad]; `chance` draws from [0, 1). None: there is no room
    in a disc."""
    pitch = pitch_of(formation, diameter)
    places = _places(formation, count, pitch, diameter, chance)
    if places is None:
        return None
    middle_x, middle_y = formation.centre_m
    ahead, across = math.cos(formation.turn_rad), math.sin(formation.turn_rad)
    given = formation.heading_rad
    return [
        [
            middle_x + x * ahead - y * across,
            middle_y + x * across + y * ahead,
            (2 * chance() - 1) * math.pi if given is None else given,
        ]
        for x, y in places
    ]


def pitch_of(formation: Formation, diameter: float) -> float:
    """Metres between neighbours."""
    usual = _PILE if formation.shape == "pile" else _PITCH
    return usual * diameter if formation.pitch_m is None else formation.pitch_m


def _places(
    formation: Formation, count: int, pitch: float, diameter: float, chance: Chance
) -> list[Place] | None:
    """About (0, 0)."""
    match formation.shape:
        case "line":
            return _line(count, pitch)
        case "grid":
            return _grid(count, pitch, formation.columns or math.ceil(math.sqrt(count)))
        case "hexagon":
            return _hexagon(count, pitch)
        case "ring":
            return _ring(count, pitch)
        case "disc":
            return _disc(count, pitch, diameter + _GAP_M, chance)
        case "pile":
            return _pile(count, pitch, diameter + _GAP_M, chance)


def _line(count: int, pitch: float) -> list[Place]:
    return [((index - (count - 1) / 2) * pitch, 0.0) for index in range(count)]


def _grid(count: int, pitch: float, most: int) -> list[Place]:
    columns = min(most, count)
    rows = -(-count // columns)
    return [
        ((index % columns - (columns - 1) / 2) * pitch, (index // columns - (rows - 1) / 2) * pitch)
        for index in range(count)
    ]


def _hexagon(count: int, pitch: float) -> list[Place]:
    """Ring after ring about the middle, each from its right corner on, counter-clockwise."""
    places = [(0.0, 0.0)]
    for ring in range(1, count):
        if len(places) >= count:
            break
        places += _ring_of_hexagon(ring, pitch)
    return places[:count]


def _ring_of_hexagon(ring: int, pitch: float) -> Iterator[Place]:
    corners = [
        (ring * pitch * math.cos(side * math.pi / 3), ring * pitch * math.sin(side * math.pi / 3))
        for side in range(7)
    ]
    for (x, y), (next_x, next_y) in itertools.pairwise(corners):
        for step in range(ring):
            share = step / ring
            yield x + share * (next_x - x), y + share * (next_y - y)


def _ring(count: int, pitch: float) -> list[Place]:
    radius = 0.0 if count == 1 else pitch / (2 * math.sin(math.pi / count))
    angles = [2 * math.pi * index / count for index in range(count)]
    return [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]


def _disc(count: int, pitch: float, least: float, chance: Chance) -> list[Place] | None:
    radius = pitch * math.sqrt(count / math.pi)
    taken: dict[tuple[int, int], list[Place]] = {}  # by squares as wide as robots are apart
    places = []
    for _ in range(count):
        for _ in range(_TRIES):
            away, angle = radius * math.sqrt(chance()), 2 * math.pi * chance()
            place = away * math.cos(angle), away * math.sin(angle)
            column, row = math.floor(place[0] / least), math.floor(place[1] / least)
            near = (
                other
                for i in (column - 1, column, column + 1)
                for j in (row - 1, row, row + 1)
                for other in taken.get((i, j), ())
            )
            if all(math.dist(place, other) >= least for other in near):
                break
        else:
            return None
        taken.setdefault((column, row), []).append(place)
        places.append(place)
    return places


def _pile(count: int, pitch: float, least: float, chance: Chance) -> list[Place]:
    """A hexagon in which each has been pushed about as far as its neighbours let it."""
    slack = max(pitch - least, 0.0) / 2
    places = []
    for x, y in _hexagon(count, pitch):
        away, angle = slack * math.sqrt(chance()), 2 * math.pi * chance()
        places.append((x + away * math.cos(angle), y + away * math.sin(angle)))
    return places
