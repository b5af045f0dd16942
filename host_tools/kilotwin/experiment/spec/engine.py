"""The engine's input: the experiment in ticks, numbers and messages."""

import itertools
import re
from typing import Any

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.experiment import Arena, ExperimentSchema, Obstacle, Site
from kilotwin.experiment.schema.medium import MEDIA
from kilotwin.experiment.schema.metric import Region
from kilotwin.experiment.schema.profile_defaults import PROFILES, Profile, motion_defaults
from kilotwin.experiment.schema.record import EXTRA_OF
from kilotwin.experiment.spec import parameter_block
from kilotwin.experiment.spec.aggregation import runs_aggregation
from kilotwin.experiment.spec.informed import informed_ranges
from kilotwin.experiment.spec.objects import object_spec
from kilotwin.experiment.spec.overhead import DUTIES, RUN, TimedMessage, timed
from kilotwin.experiment.spec.parameter_block import ALL_ROBOTS, Message
from kilotwin.experiment.spec.robot_faults import robot_faults
from kilotwin.experiment.spec.start_poses import starts
from kilotwin.experiment.toml_lines import KeyPath
from kilotwin.units import ticks

# The foot-bot's control step is 3 ticks; the floor speaks on change and every 16 ticks at least.
_FLOOR_STEP_TICKS = 3
_FLOOR_REPEAT_TICKS = 16
_OBJECT_NUMBER = re.compile(r"object (\d+) ")  # of an error; from 1
# Fields of a profile that the engine takes as they are; what can be set comes from [motion].
_BODY_KEYS = (
    "radius_m",
    "straight_left",
    "straight_right",
    "turn_left",
    "turn_right",
    "legs",
)


def engine_spec(
    experiment: Experiment,
    guests: list[str],
    *,
    sample_ticks: int,
    black_box: str | None,
    module_guest: str = "",
    lead_ticks: int = 0,
    waits: bool = False,
    debugged: tuple[int, int] | None = None,
    threads: int = 1,
) -> dict[str, Any]:
    """The spec of `_emulator.Simulation`, with every key that it has: the engine has no defaults.

    `guests`: built programs or images, one per group. On a grid, `module_guest` is its modules'
    program, and the world begins `lead_ticks` before 0. `waits`: robots are not told to run unless
    a [[command]] does. `debugged`: a robot on a chip that gdb controls, and the port for that.
    `threads` step the world.
    """
    keys, profile = experiment.keys, PROFILES[experiment.keys.swarm.profile]
    return {
        "seed": keys.seed,
        "step_ticks": keys.engine.step_ticks,
        "arena": {**_shape(keys.arena), "blocks_light": bool(keys.arena.blocks_light)},
        "sites": list(map(_placed, keys.site)),
        "obstacles": [
            {
                **_placed(obstacle),
                "heading_rad": float(obstacle.heading_rad),
                "blocks_light": obstacle.blocks_light,
            }
            for obstacle in keys.obstacle
        ],
        "picture": None if experiment.floor is None else experiment.floor.spec(),
        "objects": [object_spec(thing) for thing in keys.object],
        "profile": _profile(profile, keys),
        "floor": _floor(keys) if keys.swarm.floor else None,
        "medium": _medium(keys),
        "light": {
            "ambient": keys.light.ambient,
            "sources": [
                {**dict(source), "at_m": [float(part) for part in source.at_m]}
                for source in keys.light.source
            ],
            "picture": None if experiment.light is None else experiment.light.spec(),
            "white": 0.0 if keys.light.picture is None else float(keys.light.picture.white),
        },
        "battery_h": keys.battery.hours,
        "readings": {"temperature": keys.temperature},
        "groups": [
            {
                "program": guest,
                "name": group.program.name,
                "count": group.count,
                "tier": group.tier,
                "poses": poses,
            }
            for group, guest, poses in zip(
                experiment.groups, guests, starts(experiment), strict=True
            )
        ],
        "lab": _lab(experiment, profile),
        "commands": commands(experiment, waits=waits),
        "faults": robot_faults(experiment),
        "overhead": list(map(_placed, keys.overhead)),
        "grid": None if keys.grid is None else _grid(experiment, module_guest),
        "on_ticks": 0 if lives_through_on_s(experiment) else ticks(keys.swarm.on_s or 0.0),
        "lead_ticks": lead_ticks,
        "sample_ticks": sample_ticks,
        "sample_extras": {extra: keys.record.has(extra) for extra in set(EXTRA_OF.values())},
        "black_box": black_box,
        "debugged": debugged and {"robot": debugged[0], "port": debugged[1]},
        "run_ahead": True,
        "recalls_passes": True,
        "threads": threads,
    }


def lives_through_on_s(experiment: Experiment) -> bool:
    """Whether robots wait for `swarm.on_s`: chips do, whose kilo_ticks lie at an unknown place."""
    return any(group.on_board for group in experiment.groups)


def place_of_error(experiment: Experiment, what: str, module_guest: str = "") -> KeyPath:
    """The table that an error of the engine is about, which did not like its spec."""
    if module_guest and what.startswith(module_guest):
        return ("grid",)
    if found := _OBJECT_NUMBER.match(what):
        return "object", int(found[1]) - 1
    return ("robots",) if experiment.keys.robots else ("swarm",)


def _profile(profile: Profile, keys: ExperimentSchema) -> dict[str, Any]:
    motion = motion_defaults(profile) if keys.motion is None else dict(keys.motion)
    push_m_s2 = motion.pop("push_n") / motion["mass_kg"]
    return {
        **{key: getattr(profile, key) for key in _BODY_KEYS},
        **motion,
        "push_m_s2": push_m_s2,
    }


def _floor(keys: ExperimentSchema) -> dict[str, Any]:
    return {
        "obstacle_m": keys.reading.obstacle_m,
        "step_ticks": _FLOOR_STEP_TICKS,
        "repeat_ticks": _FLOOR_REPEAT_TICKS,
    }


def _medium(keys: ExperimentSchema) -> dict[str, Any]:
    own = {key: value for key, value in keys.medium if value is not None}
    obeyed = MEDIA[keys.medium.kind].of_reading
    return {**own, **{key: getattr(keys.reading, key) for key in obeyed}}


def _grid(experiment: Experiment, module_guest: str) -> dict[str, Any]:
    keys = experiment.keys
    assert keys.grid is not None
    assert experiment.modules is not None
    return {
        "columns": keys.grid.columns,
        "rows": keys.grid.rows,
        "buses": keys.grid.buses,
        "program": module_guest,
        "name": experiment.modules.program.name,
        "tier": experiment.modules.tier,
        "cells": dict(keys.grid.cells),
        "faults": [
            {"at_tick": ticks(fault.at_s), "kind": fault.kind, "module": fault.module}
            for fault in keys.faults.module
        ],
        "error_share": keys.faults.error_share,
    }


def _shape(place: Arena | Obstacle | Region | Site) -> dict[str, Any]:
    """About its own (0, 0)."""
    if place.shape == "picture":
        return {"shape": "picture"}
    if place.shape == "circle":
        return {"shape": "circle", "width_m": place.diameter_m, "height_m": place.diameter_m}
    if place.shape == "rectangle":
        return {"shape": "rectangle", "width_m": place.width_m, "height_m": place.height_m}
    assert place.points_m is not None
    points = [[float(part) for part in point] for point in place.points_m]
    return {"shape": "polygon", "points_m": points}


def _placed(place: Obstacle | Region | Site) -> dict[str, Any]:
    """The shape, and where its (0, 0) is."""
    centre_m = [float(part) for part in place.centre_m or (0.0, 0.0)]
    return {**_shape(place), "centre_m": centre_m}


def _lab(experiment: Experiment, profile: Profile) -> list[dict[str, Any]]:
    """Duties that a lab's file leaves out are the profile's."""
    robots: list[dict[str, Any]] = []
    if not experiment.lab:
        return robots
    from kilotwin.experiment.lab_file import TABLES

    tables = TABLES
    for uid, robot in experiment.lab:
        duties = {
            key: getattr(profile, key) if getattr(robot, key) is None else getattr(robot, key)
            for key in DUTIES
        }
        robots.append({"uid": uid, **duties, **{key: getattr(robot, key) for key in tables}})
    return robots


def commands(experiment: Experiment, *, waits: bool = False) -> list[TimedMessage]:
    """CONFIG, one message per tick, the last two ticks before t = 0; then RUN, or [[command]].

    With `waits` there is no RUN but that of a [[command]].

    On a grid there is no overhead controller: all of it comes through the modules.
    """
    keys = experiment.keys
    if keys.grid is not None:
        return []
    messages = config_messages(experiment)
    first_tick = -1 - len(messages)
    configs: list[TimedMessage] = [
        (first_tick + slot, first_uid, last_uid, message, None)
        for slot, (first_uid, last_uid, message) in enumerate(messages)
    ]
    if keys.command is None and waits:
        return configs
    if keys.command is None:
        return [*configs, (0, *ALL_ROBOTS, RUN, None)]
    profile = PROFILES[keys.swarm.profile]
    orders = [timed(command, profile) for command in keys.command]
    return [*configs, *itertools.chain.from_iterable(orders)]


def config_messages(experiment: Experiment) -> list[Message]:
    """(first uid, last uid, message): the blocks of parameters, in the order of sending."""
    declared: list[Message] = []
    if experiment.wire is not None:
        declared = [(*ALL_ROBOTS, message) for message in experiment.wire.messages()]
    return [*_of_aggregation(experiment.keys), *declared]


def _of_aggregation(keys: ExperimentSchema) -> list[Message]:
    report_s = 0.0 if keys.grid is None else keys.grid.report_s
    if keys.controller is None:
        # Robots that run the firmware with its own parameters report too.
        reports = keys.grid is not None and runs_aggregation(keys)
        return [parameter_block.reports_message(report_s)] if reports else []
    informed = informed_ranges(keys)
    return parameter_block.config_messages(keys.controller, keys.reading, report_s, informed)


def config_differences(experiment: Experiment) -> list[bytes]:
    """The messages that robots need which have just started: all that is not their default."""
    of_aggregation = [message for _, _, message in _of_aggregation(experiment.keys)]
    declared = [] if experiment.wire is None else experiment.wire.messages()
    return [*(one for one in of_aggregation if not parameter_block.is_default(one)), *declared]
