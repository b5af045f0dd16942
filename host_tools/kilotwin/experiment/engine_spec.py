"""The engine's input: the experiment in ticks, numbers and messages."""

import itertools
import re
from typing import Any, get_args

from kilotwin import _emulator
from kilotwin.experiment.aggregation import runs_aggregation
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.informed import informed_ranges
from kilotwin.experiment.lab_file import TABLES
from kilotwin.experiment.objects import object_spec
from kilotwin.experiment.overhead import ALL_ROBOTS, DUTIES, RUN, TimedMessage, timed
from kilotwin.experiment.profile_defaults import PROFILES, Profile, motion_defaults
from kilotwin.experiment.schema import (
    Arena,
    Controller,
    ExperimentSchema,
    Obstacle,
    Reading,
    Site,
)
from kilotwin.experiment.section import Section
from kilotwin.experiment.start_poses import starts
from kilotwin.experiment.toml_lines import KeyPath
from kilotwin.units import q16, ticks, ticks_q16

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
    module_guest: str | None = None,
    lead_ticks: int = 0,
    waits: bool = False,
) -> dict[str, Any]:
    """The spec of `_emulator.Simulation`, with every key that it has: the engine has no defaults.

    `guests`: built programs or images, one per group. On a grid, `module_guest` is its modules'
    program, and the world begins `lead_ticks` before 0. `waits`: robots are not told to run unless
    a [[command]] does.
    """
    keys = experiment.keys
    profile = PROFILES[keys.swarm.profile]
    floor = {
        "obstacle_m": keys.reading.obstacle_m,
        "step_ticks": _FLOOR_STEP_TICKS,
        "repeat_ticks": _FLOOR_REPEAT_TICKS,
    }
    return {
        "seed": keys.seed,
        "step_ticks": keys.engine.step_ticks,
        "contact_solver": keys.engine.contact_solver,
        "arena": {**_shape(keys.arena), "blocks_light": bool(keys.arena.blocks_light)},
        "sites": [{**_shape(site), "centre_m": _centre(site)} for site in keys.site],
        "obstacles": [
            {
                **_shape(obstacle),
                "centre_m": _centre(obstacle),
                "heading_rad": float(obstacle.heading_rad),
                "blocks_light": obstacle.blocks_light,
            }
            for obstacle in keys.obstacle
        ],
        "picture": None if experiment.floor is None else experiment.floor.spec(),
        "objects": [object_spec(thing) for thing in keys.object],
        "profile": _profile(profile, keys),
        "floor": floor if keys.swarm.floor else None,
        "medium": _medium(keys),
        "light": {
            "ambient": keys.light.ambient,
            "sources": [
                {**source.model_dump(), "at_m": [float(part) for part in source.at_m]}
                for source in keys.light.source
            ],
            "picture": None if experiment.light is None else experiment.light.spec(),
            "white": 0.0 if keys.light.picture is None else float(keys.light.picture.white),
        },
        "battery_h": keys.battery.hours,
        "temperature": keys.temperature,
        "groups": [
            {
                "program": guest,
                "name": group.program.name,
                "count": group.count,
                "on_board": group.on_board,
                "poses": poses,
            }
            for group, guest, poses in zip(
                experiment.groups, guests, starts(experiment), strict=True
            )
        ],
        "lab": _lab(experiment, profile),
        "commands": commands(experiment, waits=waits),
        "grid": None if keys.grid is None else _grid(experiment, module_guest),
        "lead_ticks": lead_ticks,
        "sample_ticks": sample_ticks,
        "black_box": black_box,
        "run_ahead": True,
    }


def place_of_error(experiment: Experiment, what: str, module_guest: str | None = None) -> KeyPath:
    """The table that an error of the engine is about, which did not like its spec."""
    if module_guest is not None and what.startswith(module_guest):
        return ("grid",)
    if found := _OBJECT_NUMBER.match(what):
        return "object", int(found[1]) - 1
    return ("robots",) if experiment.keys.robots else ("swarm",)


def _profile(profile: Profile, keys: ExperimentSchema) -> dict[str, Any]:
    motion = motion_defaults(profile) if keys.motion is None else keys.motion.model_dump()
    push_m_s2 = motion.pop("push_n") / motion["mass_kg"]
    return {
        **{key: getattr(profile, key) for key in _BODY_KEYS},
        **motion,
        "push_m_s2": push_m_s2,
    }


def _medium(keys: ExperimentSchema) -> dict[str, Any]:
    own = keys.medium.model_dump(exclude_none=True)
    if keys.medium.kind == "ideal":
        own["line_of_sight"] = keys.reading.line_of_sight
    return own


def _grid(experiment: Experiment, module_guest: str | None) -> dict[str, Any]:
    keys = experiment.keys
    assert keys.grid is not None
    assert experiment.modules is not None
    return {
        "columns": keys.grid.columns,
        "rows": keys.grid.rows,
        "buses": keys.grid.buses,
        "program": module_guest,
        "name": experiment.modules.program.name,
        "on_board": experiment.modules.on_board,
        "cells": keys.grid.cells.model_dump(),
        "faults": [
            {"at_tick": ticks(fault.at_s), "kind": fault.kind, "module": fault.module}
            for fault in keys.faults.module
        ],
        "error_share": keys.faults.error_share,
    }


def _shape(place: Arena | Obstacle | Site) -> dict[str, Any]:
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


def _centre(place: Obstacle | Site) -> list[float]:
    return [float(part) for part in place.centre_m or (0.0, 0.0)]


def _lab(experiment: Experiment, profile: Profile) -> list[dict[str, Any]]:
    """Duties that a lab's file leaves out are the profile's."""
    robots = []
    for uid, robot in experiment.lab:
        duties = {
            key: getattr(profile, key) if getattr(robot, key) is None else getattr(robot, key)
            for key in DUTIES
        }
        robots.append({"uid": uid, **duties, **{key: getattr(robot, key) for key in TABLES}})
    return robots


def commands(experiment: Experiment, *, waits: bool = False) -> list[TimedMessage]:
    """CONFIG, one message per tick, the last two ticks before t = 0; then RUN, or [[command]].

    With `waits` there is no RUN but that of a [[command]].

    On a grid there is no overhead controller: all of it comes through the modules.
    """
    keys = experiment.keys
    if keys.grid is not None:
        return []
    messages = config_messages(keys)
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
    orders = [timed(command, profile, experiment.uid_of) for command in keys.command]
    return [*configs, *itertools.chain.from_iterable(orders)]


def config_messages(keys: ExperimentSchema) -> list[tuple[int, int, bytes]]:
    """(first uid, last uid, message): every parameter for all, then each site's informed robots."""
    report_s = 0.0 if keys.grid is None else keys.grid.report_s
    if keys.controller is None:
        # Robots that run the firmware with its own parameters report too.
        reports = keys.grid is not None and runs_aggregation(keys)
        return [_for_all("TRACKING_TICKS", ticks(report_s))] if reports else []
    settings = [
        (*ALL_ROBOTS, name, value)
        for name, value in config_values(keys.controller, keys.reading, report_s).items()
    ]
    for site, first_id, count in informed_ranges(keys):
        settings.append((first_id + 1, first_id + count, "INFORMED_SITE", site))
    return [_config(*setting) for setting in settings]


def _for_all(name: str, value: int) -> tuple[int, int, bytes]:
    return _config(*ALL_ROBOTS, name, value)


def _config(first: int, last: int, name: str, value: int) -> tuple[int, int, bytes]:
    key = _emulator.CONFIG_KEYS[name][0]
    return first, last, _emulator.config_message(first, last, key, value)


def config_differences(keys: ExperimentSchema) -> list[bytes]:
    """The messages that robots need which have just started: all that is not their default."""
    defaults = {key: default for key, default, _, _ in _emulator.CONFIG_KEYS.values()}
    return [
        message
        for _, _, message in config_messages(keys)
        if int.from_bytes(message[5:9], "little") != defaults[message[4]]
    ]


def config_values(
    controller: Controller, reading: Reading, report_s: float = 0.0
) -> dict[str, int]:
    """The value of every key of default_params.h but INFORMED_SITE, in the firmware's units."""
    return {
        "RULE": _choice(controller, "rule"),
        "ALPHA": q16(controller.alpha),
        "BETA": q16(controller.beta),
        "FIRAT_A": q16(controller.a),
        "FIRAT_K": q16(controller.k),
        "UPDATE_TICKS": ticks(controller.update_s),
        "STRAIGHT_TICKS": ticks(controller.straight_s),
        "ENTRY_TICKS": ticks(controller.entry_s),
        "RHO": q16(controller.rho),
        "TURN_TICKS_PER_RAD": ticks_q16(controller.turn_s_per_rad),
        "WINDOW_TICKS": ticks(controller.neighbour_window_s),
        "TIMEOUT_TICKS": ticks(controller.neighbour_timeout_s),
        "CAPACITY": controller.neighbour_capacity,
        "EMPTY_WINDOWS": controller.empty_windows,
        "STEP_TICKS": ticks(controller.control_step_s),
        "WALL_IGNORE_TICKS": ticks(controller.wall_ignore_s),
        "LEAVE_TURN": int(controller.leave_turn),
        "TRACKING_TICKS": ticks(report_s),
        "SIGNAL_FROM": _choice(reading, "signal_from"),
        "FIRST_LEAVE": _choice(reading, "first_leave"),
        "WALK_OUT": _choice(reading, "walk_out"),
        "ENTRY_OBSTACLE": _choice(reading, "entry_obstacle"),
        "COUNT_SELF": int(reading.count_self),
        "FIRAT_JOIN": _choice(reading, "firat_join"),
        "FIRAT_SIGNAL_FROM": _choice(reading, "firat_signal_from"),
        "START_ON_SITE": _choice(reading, "start_on_site"),
        "UPDATE_CLOCK": _choice(reading, "update_clock"),
        "PUSHED_OFF": _choice(reading, "pushed_off"),
    }


def _choice(section: Section, key: str) -> int:
    """The place of the chosen word among the schema's choices: default_params.h numbers them so."""
    choices = get_args(type(section).model_fields[key].annotation)
    return choices.index(getattr(section, key))
