"""Checks of objects that robots push: their shapes, and whether they fit where they are put."""

import itertools
from collections.abc import Iterator

from kilotwin.experiment.areas import Area, area_of, disc, lies_inside, overlap
from kilotwin.experiment.checks.arena import shape_problems
from kilotwin.experiment.checks.grid import Problem
from kilotwin.experiment.convex import narrowest_m
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.spec.objects import areas_at, parts_of, pieces_of
from kilotwin.experiment.toml_lines import KeyPath

_MOST_CORNERS = 100
_NARROWEST = 0.2  # radii of a robot: the contact engine leaves out what is finer
_SET_M = 0.0001  # so much may poses overlap, which are rounded numbers


def object_problems(experiment: ExperimentSchema) -> Iterator[Problem]:
    """Most basic first; arena and obstacles are right."""
    for index, thing in enumerate(experiment.object):
        path: KeyPath = ("object", index)
        yield from shape_problems(path, thing)
        for number, part in enumerate(thing.part):
            yield from shape_problems((*path, "part", number), part)
        for number, area in enumerate(parts_of(thing)):
            own = (*path, "part", number) if thing.part else path
            yield from _fine(own, area, PROFILES[experiment.swarm.profile].radius_m)
    yield from _places(experiment)


def _fine(path: KeyPath, area: Area, radius: float) -> Iterator[Problem]:
    """Pieces that are too small for the contact engine."""
    least = _NARROWEST * radius
    if len(area.corners) > _MOST_CORNERS:
        what = f"an object's polygon has {_MOST_CORNERS} corners at most; leave some out"
        yield Problem(what, ((*path, "points_m"),))
        return
    widths = [narrowest_m(piece) for piece in pieces_of(area)] or [area.width]
    if min(widths) < least:
        what = (
            f"a piece of this object is {min(widths):.2g} m wide, less than the {least:.2g} m that "
            "contacts of these robots can tell; make it wider, or leave corners out"
        )
        yield Problem(what, (path,))


def _places(experiment: ExperimentSchema) -> Iterator[Problem]:
    """Where they begin; those without a pose find their places in the engine."""
    arena = area_of(experiment.arena)
    areas = placed_objects(experiment)
    for index, parts in areas.items():
        path: KeyPath = ("object", index, "pose")
        if not all(lies_inside(part, arena) for part in parts):
            what = "there this object does not lie inside the arena; move it or make it smaller"
            yield Problem(what, (path, ("arena",)))
        for number, obstacle in enumerate(experiment.obstacle):
            if any(overlap(part, area_of(obstacle)) for part in parts):
                what = "there this object lies in an obstacle; move one of them"
                yield Problem(what, (path, ("obstacle", number)))
    for (one, parts), (other, others) in itertools.combinations(areas.items(), 2):
        if any(overlap(a, b) for a, b in itertools.product(parts, others)):
            what = "there this object lies in another one; move one of them"
            yield Problem(what, (("object", other, "pose"), ("object", one)))


def placed_objects(experiment: ExperimentSchema) -> dict[int, list[Area]]:
    """The parts of those that are given a pose, by the number from 0."""
    return {
        index: areas_at(thing, thing.pose)
        for index, thing in enumerate(experiment.object)
        if thing.pose is not None
    }


def object_at(robot: Area, objects: dict[int, list[Area]]) -> int | None:
    """The number from 0 of an object that a robot would stand in; None without one."""
    smaller = disc(robot.x, robot.y, robot.width - 2 * _SET_M)
    stood_in = (i for i, parts in objects.items() if any(overlap(smaller, part) for part in parts))
    return next(stood_in, None)


def poses_in_objects(experiment: ExperimentSchema) -> Iterator[Problem]:
    """Robots' start poses in an object."""
    objects = placed_objects(experiment)
    if not objects:
        return
    diameter = 2 * PROFILES[experiment.swarm.profile].radius_m
    for group, kind in enumerate(experiment.robots or []):
        for index, (x, y, _) in enumerate(kind.poses or []):
            number = object_at(disc(x, y, diameter), objects)
            if number is not None:
                what = f"a robot at ({x:g}, {y:g}) m stands in an object; move one of them"
                yield Problem(what, (("robots", group, "poses", index), ("object", number)))
