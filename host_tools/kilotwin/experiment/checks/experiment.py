"""Checks that concern several keys of an experiment: sites in the arena, room for all robots."""

import itertools
import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from kilotwin.experiment.areas import Area, area_of, lies_inside
from kilotwin.experiment.checks.arena import (
    arena_problems,
    free_square_metres,
    in_doubt,
    narrow,
    pose_problems,
    shape_problems,
)
from kilotwin.experiment.checks.controller import controller_problems, informed_problems
from kilotwin.experiment.checks.crowds import crowded
from kilotwin.experiment.checks.grid import Problem, grid_problems, within_the_run
from kilotwin.experiment.checks.metric import metric_problems
from kilotwin.experiment.checks.object import object_problems, poses_in_objects
from kilotwin.experiment.checks.robot_fault import robot_fault_problems
from kilotwin.experiment.checks.robots import uids_text
from kilotwin.experiment.checks.step import step_problems
from kilotwin.experiment.schema.experiment import Command, Cpu, ExperimentSchema, Robots
from kilotwin.experiment.schema.grid import Grid
from kilotwin.experiment.schema.medium import MEDIA, MEDIUM_DEFAULTS
from kilotwin.experiment.schema.profile_defaults import PROFILES, motion_defaults
from kilotwin.experiment.schema.section import LAST_UID
from kilotwin.experiment.spec.objects import parts_of
from kilotwin.experiment.spec.overhead import KEYS, uids
from kilotwin.experiment.toml_lines import KeyPath

# Robots placed one after the other at random stop fitting somewhere above half of the area.
_FULLEST_SHARE = 0.5
_TOUCHING = 0.01  # of a diameter: so much may two poses overlap, which are rounded numbers


def first_problem(
    experiment: ExperimentSchema, is_set: Callable[[KeyPath], bool]
) -> Problem | None:
    """The problem to mend first, if any. `is_set`: whether a key was set for this run alone."""
    for problem in _problems(experiment):
        if problem.unless_set is None or not is_set(problem.unless_set):
            return problem
    return None


def first_problem_of_command(command: Command, robots: Sequence[int]) -> Problem | None:
    """The same for a [[command]] alone, to robots with these uids."""
    return next(_command(("command", 0), command, robots), None)


def uids_there(experiment: ExperimentSchema) -> Sequence[int]:
    """Uids with which the robots begin; of a lab, which is not read yet, all that there may be."""
    if (given := uids_of(experiment)) is not None:
        return given
    if experiment.swarm.lab is not None:
        return range(LAST_UID + 1)
    return range(1, swarm_size(experiment) + 1)


def swarm_size(experiment: ExperimentSchema) -> int:
    """How many robots there are in all."""
    if experiment.robots is not None:
        return sum(kind.count for kind in experiment.robots)
    return experiment.swarm.size or 0


def uids_of(experiment: ExperimentSchema) -> list[int] | None:
    """The uid of each robot, by index; None where neither [swarm] nor [[robots]] says one."""
    kinds, from_uid = experiment.robots or [], experiment.swarm.first_uid
    said = (from_uid, *(one for kind in kinds for one in (kind.uids, kind.first_uid)))
    if all(one is None for one in said):
        return None
    from_uid = 1 if from_uid is None else from_uid
    if experiment.robots is None:
        return list(range(from_uid, from_uid + swarm_size(experiment)))
    uids: list[int] = []
    for kind in kinds:
        first = len(uids) + from_uid if kind.first_uid is None else kind.first_uid
        uids += range(first, first + kind.count) if kind.uids is None else kind.uids
    return uids


def _problems(experiment: ExperimentSchema) -> Iterator[Problem]:
    """Most basic first: each check may rely on what those before it found right."""
    yield from arena_problems(experiment)
    yield from object_problems(experiment)
    yield from _programs(experiment)
    yield from _uids(experiment)
    yield from _gains(experiment)
    yield from _room(experiment)
    yield from _aggregation(experiment)
    yield from _states(experiment)
    yield from _motion(experiment)
    yield from _medium(experiment)
    yield from _start(experiment)
    yield from _environment(experiment)
    yield from _overhead(experiment)
    yield from grid_problems(experiment)
    robots = uids_there(experiment)
    for index, command in enumerate(experiment.command or []):
        yield from _command(("command", index), command, robots)
        yield from within_the_run(("command", index, "at_s"), command.at_s, experiment)
    yield from step_problems(experiment, robots)
    yield from robot_fault_problems(experiment, robots)
    yield from metric_problems(experiment)
    if experiment.expect:
        from kilotwin.experiment.checks.expect import expect_problems

        yield from expect_problems(experiment)
    yield from _record(experiment)


def _programs(experiment: ExperimentSchema) -> Iterator[Problem]:
    for key in ("program", "size"):
        given = getattr(experiment.swarm, key) is not None
        if experiment.robots is not None and given:
            what = f"[[robots]] takes the place of swarm.{key}; keep one of them"
            yield Problem(what, (("swarm", key),))
        if experiment.robots is None and not given:
            what = f"[swarm] lacks '{key}'; add it, or [[robots]] for several programs"
            yield Problem(what, (("swarm",),))
    if experiment.robots == []:
        what = "there is no robot; add a [[robots]] table with program and count"
        yield Problem(what, (("robots",),))
    elif swarm_size(experiment) == 0 and experiment.robots is not None:
        what = "there is no robot: each count is 0; make one of them 1 or more"
        yield Problem(what, (("robots", 0, "count"),))
    medium = experiment.medium.kind
    for index, robots in enumerate(experiment.robots or []):
        if robots.program is None and robots.hex is None:
            what = "these robots lack 'program', or 'hex'; add one of them"
            yield Problem(what, (("robots", index),))
        common = None if robots.hex is not None else experiment.swarm.cpu
        yield from _kind(("robots", index), robots, common, medium)
    if experiment.robots is None and experiment.swarm.cpu == "avr" and not MEDIA[medium].has_pulses:
        yield _without_pulses(("swarm", "cpu"), "robots", medium)
    if experiment.grid is not None:
        yield from _kind(("grid",), experiment.grid, None, medium)


def _kind(table: KeyPath, run: Robots | Grid, common: Cpu | None, medium: str) -> Iterator[Problem]:
    """Problems of one table; `common` is the processor where the table names none."""
    cpu = run.cpu or common
    if run.hex is not None:
        for key in ("program", "include", "define"):
            if key in run.model_fields_set and getattr(run, key):
                yield Problem(f"with 'hex' there is no '{key}'; keep one of them", ((*table, key),))
        if run.runtime is not None:
            what = "a 'hex' has its own runtime; leave runtime out"
            yield Problem(what, ((*table, "runtime"),))
        if isinstance(run, Robots) and run.printf == "floats":
            what = "a 'hex' has its own printf(); leave printf out"
            yield Problem(what, ((*table, "printf"),))
        if run.cpu not in (None, "avr"):
            what = "a 'hex' runs on an ATmega328P; leave cpu out"
            yield Problem(what, ((*table, "cpu"),))
    if isinstance(run, Grid) and run.boot_loader and run.runtime == "original":
        what = "our boot loader comes with our runtime; leave runtime out"
        yield Problem(what, ((*table, "runtime"),))
    if run.boot_loader and run.hex is None and cpu != "avr":
        what = 'a boot loader is for an ATmega328P; set cpu to "avr"'
        yield Problem(what, ((*table, "boot_loader"),))
    if (run.hex is not None or cpu == "avr") and not MEDIA[medium].has_pulses:
        path: KeyPath = ("swarm", "cpu")
        if run.hex is not None or run.cpu is not None:
            path = (*table, "cpu" if run.hex is None else "hex")
        what_runs = "robots" if isinstance(run, Robots) else "modules"
        yield _without_pulses(path, what_runs, medium)


def _uids(experiment: ExperimentSchema) -> Iterator[Problem]:
    uids = uids_of(experiment) or []
    for index, kind in enumerate(experiment.robots or []):
        path: KeyPath = ("robots", index, "uids")
        if kind.uids is not None and kind.first_uid is not None:
            yield Problem("these robots have first_uid too; keep one of them", (path,))
        if kind.uids is not None and len(kind.uids) != kind.count:
            what = f"{len(kind.uids)} uids for {kind.count} robots; give one each, or none at all"
            yield Problem(what, (path,))
    if max(uids, default=0) > LAST_UID:
        what = f"the last robot would have the uid {max(uids)}, above {LAST_UID}; begin lower"
        yield Problem(what, (("robots",), ("swarm", "first_uid")))
    if len(set(uids)) < len(uids):
        twice = Counter(uids).most_common(1)[0][0]
        what = (
            f"two robots have the uid {twice}; give each its own (robots without uids have index "
            "+ 1, or index + swarm.first_uid)"
        )
        yield Problem(what, (("robots",),))


def _gains(experiment: ExperimentSchema) -> Iterator[Problem]:
    for index, (near, far) in enumerate(itertools.pairwise(experiment.swarm.gains or []), 1):
        path: KeyPath = ("swarm", "gains", index)
        if far[0] <= near[0]:
            what = f"{far[0]:g} mm comes after {near[0]:g} mm; write the nearest distance first"
            yield Problem(what, (path,))
        if far[1] > near[1] or far[2] > near[2]:
            what = f"a reading rises from {near[0]:g} to {far[0]:g} mm; they fall with the distance"
            yield Problem(what, (path,))


def _without_pulses(path: KeyPath, what_runs: str, medium: str) -> Problem:
    other = next(name for name, kind in MEDIA.items() if kind.has_pulses)
    what = f'{what_runs} on an ATmega328P send pulses, which medium.kind = "{medium}" has not;'
    return Problem(f'{what} set it to "{other}"', (path, ("medium", "kind")))


def _room(experiment: ExperimentSchema) -> Iterator[Problem]:
    radius = PROFILES[experiment.swarm.profile].radius_m
    for group, kind in enumerate(experiment.robots or []):
        yield from _poses(("robots", group, "poses"), kind, experiment, radius)
    yield from poses_in_objects(experiment)
    yield from _apart(experiment, 2 * radius)
    if narrow(experiment, radius):
        what = f"no robot fits into the arena: it is {2 * radius:g} m wide; take more room"
        yield Problem(what, (("arena",),))
    count = swarm_size(experiment)
    free = free_square_metres(experiment, area_of(experiment.arena))
    free -= sum(part.square_metres for thing in experiment.object for part in parts_of(thing))
    fit = max(int(_FULLEST_SHARE * free / (math.pi * radius**2)), 0)
    if count > fit:
        key: KeyPath = ("robots",) if experiment.robots else ("swarm", "size")
        what = f"{count} robots do not fit into the arena, about {fit} do; take fewer or more room"
        yield Problem(what, (key, ("arena",)))


def _poses(
    path: KeyPath, kind: Robots, experiment: ExperimentSchema, radius: float
) -> Iterator[Problem]:
    if kind.poses is None:
        return
    if len(kind.poses) != kind.count:
        what = f"{len(kind.poses)} poses for {kind.count} robots; give one each, or none at all"
        yield Problem(what, (path,))
    doubtful = in_doubt(_places(kind.poses), radius, experiment)
    for index in map(int, np.flatnonzero(doubtful)):
        x, y, _ = kind.poses[index]
        yield from pose_problems((*path, index), x, y, radius, experiment)


def _places(poses: Sequence[Sequence[float]]) -> NDArray[np.float64]:
    """[k, 2]: x_m and y_m of poses."""
    return np.array(poses, np.float64).reshape(-1, 3)[:, :2]


def _apart(experiment: ExperimentSchema, diameter: float) -> Iterator[Problem]:
    """No two robots that are given their poses stand in the same place."""
    least = (1 - _TOUCHING) * diameter
    given = [kind.poses or [] for kind in experiment.robots or []]
    near_others = crowded(_places([pose for poses in given for pose in poses]), diameter)
    robots = ((group, index) for group, poses in enumerate(given) for index in range(len(poses)))
    stand: dict[tuple[int, int], list[tuple[KeyPath, float, float]]] = {}  # by squares
    for group, index in itertools.compress(robots, near_others):
        x, y, _ = given[group][index]
        path: KeyPath = ("robots", group, "poses", index)
        column, row = math.floor(x / diameter), math.floor(y / diameter)
        for near in itertools.product(range(column - 1, column + 2), range(row - 1, row + 2)):
            for other, other_x, other_y in stand.get(near, ()):
                if math.hypot(x - other_x, y - other_y) < least:
                    what = (
                        f"robots at ({other_x:g}, {other_y:g}) and ({x:g}, {y:g}) m stand in "
                        f"one another; move them {diameter:g} m apart"
                    )
                    yield Problem(what, (path, other))
                    return
        stand.setdefault((column, row), []).append((path, x, y))


def _aggregation(experiment: ExperimentSchema) -> Iterator[Problem]:
    sites = [site.name for site in experiment.site]
    size, controller = swarm_size(experiment), experiment.controller
    for what, *paths in informed_problems(experiment.swarm, controller, sites, size):
        yield Problem(what, tuple(paths))
    for what, *paths in controller_problems(controller):
        yield Problem(what, tuple(paths))


def _states(experiment: ExperimentSchema) -> Iterator[Problem]:
    first: dict[tuple[int, ...], str] = {}
    for name, colour in (experiment.states or {}).items():
        other = first.setdefault(tuple(colour), name)
        if other != name:
            what = f"'{name}' has the colour of '{other}'; give each state its own"
            yield Problem(what, (("states", name), ("states", other)))


def _motion(experiment: ExperimentSchema) -> Iterator[Problem]:
    profile = PROFILES[experiment.swarm.profile]
    if experiment.motion is None or profile.legs:
        return
    for key, fixed in motion_defaults(profile).items():
        if getattr(experiment.motion, key) != fixed:
            what = f"the motion of a {profile.name} is fixed; remove '{key}', or take a kilobot"
            yield Problem(what, (("motion", key), ("swarm", "profile")))


def _environment(experiment: ExperimentSchema) -> Iterator[Problem]:
    if experiment.environment is None:
        return
    if experiment.grid is not None:
        what = "a grid's cells do what camera and overhead controller would; remove one of them"
        yield Problem(what, (("environment",), ("grid",)))
    from kilotwin.experiment.spec.ark import WORD_BITS, Layout

    bits: KeyPath = ("environment", "word_bits")
    if sum(experiment.environment.word_bits) != WORD_BITS:
        total = sum(experiment.environment.word_bits)
        yield Problem(f"these are {total} bits; a word has {WORD_BITS}", (bits,))
    last = Layout(*experiment.environment.word_bits).most_uid
    if swarm_size(experiment) > last:
        what = f"words reach robots 1 to {last}; take fewer robots, or remove [environment]"
        yield Problem(what, (("environment",),))


def _overhead(experiment: ExperimentSchema) -> Iterator[Problem]:
    for index, controller in enumerate(experiment.overhead):
        path: KeyPath = ("overhead", index)
        yield from shape_problems(path, controller)
        if controller.centre_m is None and controller.shape != "polygon":
            what = "[[overhead]] lacks 'centre_m', the place below it; add centre_m = [0.0, 0.0]"
            yield Problem(what, (path,))
        if experiment.grid is not None:
            what = "on a grid the cells speak to robots; remove [[overhead]], or [grid]"
            yield Problem(what, (path, ("grid",)))


def _start(experiment: ExperimentSchema) -> Iterator[Problem]:
    if experiment.swarm.start_in_m is None:
        return
    left, bottom, right, top = experiment.swarm.start_in_m
    radius = PROFILES[experiment.swarm.profile].radius_m
    path: KeyPath = ("swarm", "start_in_m")
    if right - left < 2 * radius or top - bottom < 2 * radius:
        what = "no robot fits into that rectangle; write [left, bottom, right, top], larger ones"
        yield Problem(what, (path,))
        return
    place = Area(False, (left + right) / 2, (bottom + top) / 2, right - left, top - bottom)
    if not lies_inside(place, area_of(experiment.arena)):
        what = "that rectangle does not lie inside the arena; move it or make it smaller"
        yield Problem(what, (path, ("arena",)))
    fit = int(_FULLEST_SHARE * free_square_metres(experiment, place) / (math.pi * radius**2))
    count = sum(kind.count for kind in experiment.robots or [] if kind.poses is None)
    count += experiment.swarm.size or 0
    if count > fit:
        what = f"{count} robots do not fit into that rectangle, about {fit} do"
        yield Problem(what, (path,))


def _medium(experiment: ExperimentSchema) -> Iterator[Problem]:
    medium = experiment.medium
    for key in MEDIUM_DEFAULTS.keys() - MEDIA[medium.kind].keys.keys():
        if getattr(medium, key) is not None:
            other = next(name for name, kind in MEDIA.items() if key in kind.keys)
            what = f"the {medium.kind} medium has no '{key}'; remove it, or set kind = \"{other}\""
            yield Problem(what, (("medium", key), ("medium", "kind")))


def _command(path: KeyPath, command: Command, robots: Sequence[int]) -> Iterator[Problem]:
    yield from _own_keys(path, command)
    yield from _addressees(path, command, robots)


def _own_keys(path: KeyPath, command: Command) -> Iterator[Problem]:
    """Bytes that go with the message, and those that a robot would take from it."""
    needed, more = KEYS[command.send]
    for send, (others, others_more) in KEYS.items():
        for key in (*others, *others_more):
            if key not in (*needed, *more) and getattr(command, key) is not None:
                what = f"'{key}' belongs to send = \"{send}\"; '{command.send}' has no such key"
                yield Problem(what, ((*path, key), (*path, "send")))
    for key in needed:
        if getattr(command, key) is None:
            yield Problem(f"'{command.send}' needs '{key}'; add {key} = ...", (path,))
    if command.mode == "save":
        for key in KEYS["calib"][1]:
            if getattr(command, key) is None:
                what = f"calib with mode = \"save\" writes '{key}' too; add {key} = ..."
                yield Problem(what, (path,))


def _addressees(path: KeyPath, command: Command, robots: Sequence[int]) -> Iterator[Problem]:
    for key in ("uid_first", "uid_last"):
        if command.robot is not None and getattr(command, key) is not None:
            what = f"'robot' names one robot; remove it, or '{key}'"
            yield Problem(what, ((*path, key), (*path, "robot")))
    if command.robot is not None and command.robot not in robots:
        what = f"there is no robot {command.robot}; {uids_text(robots)}"
        yield Problem(what, ((*path, "robot"),))
    first, last = uids(command)
    if first > last:
        what = f"uid_first {first} is above uid_last {last}; exchange them"
        yield Problem(what, ((*path, "uid_first"), (*path, "uid_last")))
    for key, other in (("within_m", "centre_m"), ("centre_m", "within_m")):
        if getattr(command, key) is not None and getattr(command, other) is None:
            yield Problem(f"'{key}' needs '{other}' beside it; add {other} = ...", ((*path, key),))


def _record(experiment: ExperimentSchema) -> Iterator[Problem]:
    record, size = experiment.record, swarm_size(experiment)
    chosen = [
        key
        for key in ("robots", "robots_count", "robots_share")
        if getattr(record, key) is not None
    ]
    if len(chosen) > 1:
        what = f"record.{chosen[0]} and record.{chosen[1]} both choose robots; keep one of them"
        yield Problem(what, (("record", chosen[1]),))
    share = 1.0 if record.robots_s is None else record.robots_s / record.sample_s
    if share < 0.99 or abs(share - round(share)) > 0.01:
        near = max(1, round(share)) * record.sample_s
        what = (
            f"record.robots_s is {record.robots_s:g}, no multiple of sample_s "
            f"({record.sample_s:g}); take {near:g}"
        )
        yield Problem(what, (("record", "robots_s"),))
    listed = {"columns": record.columns, "also": record.also, "robots": record.robots}
    for key, values in listed.items():
        twice = [one for one, times in Counter(values or []).items() if times > 1]
        if twice:
            yield Problem(f"record.{key} names {twice[0]} twice; name it once", (("record", key),))
    if record.has("modules") and experiment.grid is None:
        what = "record.also names modules, and there is no [grid]; remove it, or add [grid]"
        yield Problem(what, (("record", "also"),))
    missing = next((robot for robot in record.robots or [] if robot >= size), None)
    if missing is not None:
        what = f"record.robots names robot {missing}; there are robots 0 to {size - 1}"
        yield Problem(what, (("record", "robots"),))
