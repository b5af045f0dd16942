"""Checks of shapes: of the arena, and of obstacles and sites in it."""

import itertools
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from kilotwin.experiment import polygons
from kilotwin.experiment.areas import Area, area_of, disc, inside, lies_inside, overlap
from kilotwin.experiment.checks.grid import Problem
from kilotwin.experiment.schema.experiment import Arena, ExperimentSchema, Obstacle, Site
from kilotwin.experiment.schema.metric import Region
from kilotwin.experiment.schema.object import ObjectPart, PushedObject
from kilotwin.experiment.toml_lines import KeyPath

_SIZES = {
    "circle": ("diameter_m",),
    "rectangle": ("width_m", "height_m"),
    "polygon": ("points_m",),
    "picture": (),
    "joined": ("part",),
}
_EXAMPLES = {
    "points_m": "points_m = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]",
    "part": "[[object.part]] tables, each with a shape",
}
_PLACED = ("circle", "rectangle")  # by a centre
_LEAST_M = 0.001  # between two edges, or two corners
_ACROSS = 100  # points, either way, at which it is tried what is free


def arena_problems(experiment: ExperimentSchema) -> Iterator[Problem]:
    """Most basic first."""
    yield from shape_problems(("arena",), experiment.arena)
    for index, obstacle in enumerate(experiment.obstacle):
        yield from shape_problems(("obstacle", index), obstacle)
    for index, site in enumerate(experiment.site):
        yield from shape_problems(("site", index), site)
    yield from _obstacles(experiment)
    yield from _sites(experiment)


def shape_problems(
    path: KeyPath, place: Arena | Obstacle | ObjectPart | PushedObject | Region | Site
) -> Iterator[Problem]:
    """Keys that a shape lacks or does not have, and corners that make no polygon."""
    needed = _SIZES[place.shape]
    shown = "joined object" if place.shape == "joined" else place.shape
    if isinstance(place, Obstacle | Site) and place.centre_m is None and place.shape in _PLACED:
        table = f"[[{path[0]}]]"
        yield Problem(f"{table} lacks 'centre_m'; add centre_m = [0.0, 0.0]", (path,))
    for key in itertools.chain.from_iterable(_SIZES.values()):
        given = getattr(place, key, None) not in (None, [])
        if given and key not in needed:
            instead = f"use {' and '.join(needed)}" if needed else "remove it"
            what = f"a {shown} has no '{key}'; {instead}, or change shape"
            yield Problem(what, ((*path, key),))
        if not given and key in needed:
            example = _EXAMPLES.get(key, f"{key} = ...")
            yield Problem(f"a {shown} needs '{key}'; add {example}", (path,))
    if isinstance(place, Arena) and place.shape != "polygon" and place.blocks_light is not None:
        what = f"nothing is hidden by the wall of a {place.shape}; remove 'blocks_light'"
        yield Problem(what, ((*path, "blocks_light"),))
    if place.points_m is not None:
        yield from _simple((*path, "points_m"), [(x, y) for x, y in place.points_m])


def _simple(path: KeyPath, corners: list[polygons.Corner]) -> Iterator[Problem]:
    fault = polygons.first_fault(corners, _LEAST_M)
    if fault is None:
        return

    def shown(edge: int) -> str:
        (ax, ay), (bx, by) = corners[edge], corners[(edge + 1) % len(corners)]
        return f"({ax:g}, {ay:g}) to ({bx:g}, {by:g})"

    one, other = fault
    if one == other:
        what = f"the edge from {shown(one)} m is shorter than {_LEAST_M:g} m; leave a corner out"
    else:
        what = (
            f"the edges from {shown(one)} and from {shown(other)} m cross or touch; list the "
            f"corners one after the other along the outline, edges {_LEAST_M:g} m apart"
        )
    yield Problem(what, ((*path, one),))


def _obstacles(experiment: ExperimentSchema) -> Iterator[Problem]:
    arena = area_of(experiment.arena)
    for index, obstacle in enumerate(experiment.obstacle):
        area = area_of(obstacle)
        if not overlap(area, arena):
            what = "this obstacle stands outside the arena; move it in, or remove it"
            yield Problem(what, (("obstacle", index), ("arena",)))
        if lies_inside(arena, area):
            what = "this obstacle fills the arena; make it smaller"
            yield Problem(what, (("obstacle", index), ("arena",)))


def _sites(experiment: ExperimentSchema) -> Iterator[Problem]:
    arena = area_of(experiment.arena)
    drawn = [] if experiment.floor is None else list(experiment.floor.legend.values())
    for index, site in enumerate(experiment.site):
        if (site.shape == "picture") != (site.name in drawn):
            what = (
                f"site '{site.name}' has a place and is drawn; give one of them another name"
                if site.name in drawn
                else f"site '{site.name}' is not drawn; name it in [floor.legend], or change shape"
            )
            yield Problem(what, (("site", index),))
        if site.shape == "picture":
            continue
        if not lies_inside(area_of(site), arena):
            what = f"site '{site.name}' does not lie inside the arena; move it or make it smaller"
            yield Problem(what, (("site", index), ("arena",)))
        for number, obstacle in enumerate(experiment.obstacle):
            if lies_inside(area_of(site), area_of(obstacle)):
                what = f"site '{site.name}' lies under an obstacle; move one of them"
                yield Problem(what, (("site", index), ("obstacle", number)))
    for (i, one), (j, other) in itertools.combinations(enumerate(experiment.site), 2):
        if one.name == other.name:
            what = f"two sites are called '{one.name}'; give each its own name"
            yield Problem(what, (("site", j, "name"), ("site", i, "name")))
        if "picture" in (one.shape, other.shape):
            continue
        if overlap(area_of(one), area_of(other)):
            what = f"sites '{one.name}' and '{other.name}' overlap; move them apart"
            yield Problem(what, (("site", j), ("site", i)))


def free_square_metres(experiment: ExperimentSchema, place: Area) -> float:
    """How much of a place no obstacle covers, within some hundredths."""
    if not experiment.obstacle:
        return place.square_metres
    steps = (np.arange(_ACROSS) + 0.5) / _ACROSS - 0.5
    x, y = np.meshgrid(place.x + steps * place.width, place.y + steps * place.height)
    whole = inside(place, x, y)
    free: NDArray[np.bool_] = whole.copy()
    for obstacle in experiment.obstacle:
        free &= ~inside(area_of(obstacle), x, y)
    return place.square_metres * float(free.sum()) / max(int(whole.sum()), 1)


def standing_in(experiment: ExperimentSchema, robot: Area) -> int | None:
    """The number from 0 of an obstacle that a robot would stand in; None without one."""
    stood_in = (
        index
        for index, obstacle in enumerate(experiment.obstacle)
        if overlap(robot, area_of(obstacle))
    )
    return next(stood_in, None)


def pose_problems(
    path: KeyPath, x: float, y: float, radius: float, experiment: ExperimentSchema
) -> Iterator[Problem]:
    """A robot's start pose, in the wall or in an obstacle."""
    robot = disc(x, y, 2 * radius)
    if not lies_inside(robot, area_of(experiment.arena)):
        what = f"a robot at ({x:g}, {y:g}) m does not stand inside the arena; move it"
        yield Problem(what, (path, ("arena",)))
    number = standing_in(experiment, robot)
    if number is not None:
        what = f"a robot at ({x:g}, {y:g}) m stands in an obstacle; move it"
        yield Problem(what, (path, ("obstacle", number)))


def in_doubt(
    places: NDArray[np.float64], radius: float, experiment: ExperimentSchema
) -> NDArray[np.bool_]:
    """Those of robots' places, [k, 2] in metres, that pose_problems() has to look at: the others
    stand inside the arena and clear of obstacles by the boxes of these."""
    x, y = places.T
    arena = area_of(experiment.arena)
    if arena.corners or arena.width / 2 < radius + _LEAST_M:
        return np.ones(len(places), np.bool_)
    doubt = ~inside(arena, x, y, slack=-radius - _LEAST_M)
    for obstacle in experiment.obstacle:
        area = area_of(obstacle)
        box = Area(False, area.x, area.y, area.width, area.height)
        doubt |= inside(box, x, y, slack=radius + _LEAST_M)
    return doubt


def narrow(experiment: ExperimentSchema, radius: float) -> bool:
    """Whether no robot fits into the arena, as far as that is known without a try."""
    arena = area_of(experiment.arena)
    if arena.corners:
        return math.pi * radius**2 > arena.square_metres
    return not lies_inside(disc(0, 0, 2 * radius), arena)
