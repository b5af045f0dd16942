"""What the keys of an experiment must be together: sites inside the arena, shares that sum to 1, room for all."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

from kilotwin.experiment_schema import Arena, ExperimentSchema, Site
from kilotwin.profiles import PROFILES
from kilotwin.toml_lines import KeyPath

# Robots placed one after the other at random stop fitting somewhere above half of the area.
_FULLEST_SHARE = 0.5
# Sites may touch one another and the wall.
_TOUCH_M = 1e-9
_SHARE_ERROR = 1e-6
_LAST_UID = 65535

Problem = tuple[KeyPath, str]


def first_problem(experiment: ExperimentSchema) -> Problem | None:
    """What to mend first: the path of a key, what is wrong and what to do."""
    return next(_problems(experiment), None)


def _problems(experiment: ExperimentSchema) -> Iterator[Problem]:
    """Most basic first: each check may rely on what those before it found right."""
    yield from _shapes(experiment)
    yield from _swarm(experiment)
    yield from _informed(experiment)
    yield from _controller(experiment)
    yield from _states(experiment)


@dataclass(frozen=True)
class Area:
    """A circle (width = height = diameter) or an upright rectangle."""

    circle: bool
    x: float
    y: float
    width: float
    height: float

    @property
    def square_metres(self) -> float:
        """Its area."""
        return self.width * self.height * (math.pi / 4 if self.circle else 1)


def area_of(place: Arena | Site) -> Area:
    """The area of a place whose keys are complete."""
    x, y = place.centre_m if isinstance(place, Site) else (0.0, 0.0)
    if place.shape == "circle":
        assert place.diameter_m is not None
        return Area(True, x, y, place.diameter_m, place.diameter_m)
    assert place.width_m is not None
    assert place.height_m is not None
    return Area(False, x, y, place.width_m, place.height_m)


def _shapes(experiment: ExperimentSchema) -> Iterator[Problem]:
    places: list[tuple[KeyPath, Arena | Site]] = [(("arena",), experiment.arena)]
    places += [(("site", index), site) for index, site in enumerate(experiment.site)]
    for path, place in places:
        yield from _shape_keys(path, place)
    arena = area_of(experiment.arena)
    for index, site in enumerate(experiment.site):
        if not _inside(area_of(site), arena):
            yield (
                ("site", index, "centre_m"),
                f"site '{site.name}' lies outside the arena in part; move it or make it smaller",
            )
    for (_, one), (second, other) in itertools.combinations(enumerate(experiment.site), 2):
        if one.name == other.name:
            yield (
                ("site", second, "name"),
                f"two sites are called '{one.name}'; give each its own name",
            )
        if _overlap(area_of(one), area_of(other)):
            yield (
                ("site", second, "centre_m"),
                f"sites '{one.name}' and '{other.name}' overlap; move them apart",
            )


def _shape_keys(path: KeyPath, place: Arena | Site) -> Iterator[Problem]:
    needed = ["diameter_m"] if place.shape == "circle" else ["width_m", "height_m"]
    for key in ("diameter_m", "width_m", "height_m"):
        given = getattr(place, key) is not None
        if given and key not in needed:
            yield (
                (*path, key),
                f"a {place.shape} has no '{key}'; use {' and '.join(needed)}, or change shape",
            )
        if not given and key in needed:
            yield (*path, "shape"), f"a {place.shape} needs '{key}'; add {key} = ..."


def _inside(site: Area, arena: Area) -> bool:
    half_width, half_height = site.width / 2, site.height / 2
    if not arena.circle:
        return (
            abs(site.x) + half_width <= arena.width / 2 + _TOUCH_M
            and abs(site.y) + half_height <= arena.height / 2 + _TOUCH_M
        )
    if site.circle:
        farthest = math.hypot(site.x, site.y) + half_width
    else:
        farthest = math.hypot(abs(site.x) + half_width, abs(site.y) + half_height)
    return farthest <= arena.width / 2 + _TOUCH_M


def _overlap(one: Area, other: Area) -> bool:
    if one.circle and other.circle:
        apart = math.hypot(one.x - other.x, one.y - other.y)
        return apart < (one.width + other.width) / 2 - _TOUCH_M
    if one.circle:
        one, other = other, one
    away_x, away_y = abs(one.x - other.x), abs(one.y - other.y)
    if other.circle:
        gap_x, gap_y = max(away_x - one.width / 2, 0), max(away_y - one.height / 2, 0)
        return math.hypot(gap_x, gap_y) < other.width / 2 - _TOUCH_M
    return (
        away_x < (one.width + other.width) / 2 - _TOUCH_M
        and away_y < (one.height + other.height) / 2 - _TOUCH_M
    )


def _swarm(experiment: ExperimentSchema) -> Iterator[Problem]:
    swarm, robots = experiment.swarm, experiment.robots
    for key in ("program", "size"):
        given = getattr(swarm, key) is not None
        if robots is not None and given:
            yield ("swarm", key), f"[[robots]] takes the place of swarm.{key}; keep one of them"
        if robots is None and not given:
            yield ("swarm", key), f"[swarm] lacks '{key}'; add it, or [[robots]] for several programs"
    if robots is not None and not robots:
        yield ("robots",), "'robots' is empty; add a [[robots]] table with program and count"
    arena, radius = area_of(experiment.arena), PROFILES[swarm.profile].radius_m
    for group, kind in enumerate(robots or []):
        if kind.poses is not None and len(kind.poses) != kind.count:
            yield (
                ("robots", group, "poses"),
                f"{len(kind.poses)} poses for {kind.count} robots; give one each, or none at all",
            )
        for index, (x, y, _) in enumerate(kind.poses or []):
            if not _inside(Area(True, x, y, 2 * radius, 2 * radius), arena):
                yield (
                    ("robots", group, "poses", index),
                    f"a robot at ({x:g}, {y:g}) m does not stand inside the arena; move it",
                )
    count = swarm_size(experiment)
    fit = int(_FULLEST_SHARE * arena.square_metres / (math.pi * radius**2))
    if count > fit:
        yield (
            ("robots",) if robots else ("swarm", "size"),
            f"{count} robots do not fit into the arena (about {fit} do); "
            "take fewer, or a larger arena",
        )


def swarm_size(experiment: ExperimentSchema) -> int:
    """How many robots there are in all."""
    if experiment.robots is not None:
        return sum(kind.count for kind in experiment.robots)
    return experiment.swarm.size or 0


def _informed(experiment: ExperimentSchema) -> Iterator[Problem]:
    shares = experiment.swarm.informed_for
    names = [site.name for site in experiment.site]
    for name in shares:
        if name not in names:
            known = ", ".join(names) or "there are none"
            yield (
                ("swarm", "informed_for", name),
                f"there is no site '{name}'; name one of: {known}",
            )
    total = math.fsum(shares.values())
    if shares and abs(total - 1) > _SHARE_ERROR:
        yield (
            ("swarm", "informed_for"),
            f"the shares of swarm.informed_for sum to {total:g}; they must sum to 1",
        )
    if experiment.swarm.informed == 0:
        return
    if not shares:
        yield (
            ("swarm", "informed"),
            "informed for which site? Add [swarm.informed_for] with shares that sum to 1",
        )
    if experiment.controller is None:
        yield (
            ("swarm", "informed"),
            "robots are told by CONFIG what they are informed for; add [controller]",
        )
    if swarm_size(experiment) > _LAST_UID:
        yield (
            ("swarm", "informed"),
            f"CONFIG reaches robots 1 to {_LAST_UID}; take fewer robots, or informed = 0",
        )


def _controller(experiment: ExperimentSchema) -> Iterator[Problem]:
    controller = experiment.controller
    if controller and controller.neighbour_timeout_s < controller.neighbour_window_s:
        yield (
            ("controller", "neighbour_timeout_s"),
            f"neighbours are forgotten ({controller.neighbour_timeout_s:g} s) before the window "
            f"({controller.neighbour_window_s:g} s) ends; make the time-out as long at least",
        )


def _states(experiment: ExperimentSchema) -> Iterator[Problem]:
    states = experiment.states or {}
    first: dict[tuple[int, ...], str] = {}
    for name, colour in states.items():
        other = first.setdefault(tuple(colour), name)
        if other != name:
            yield ("states", name), f"'{name}' has the colour of '{other}'; give each its own"
