"""The workloads of `kilotwin bench`, as experiments."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.text import ExperimentText, Setting
from kilotwin.files import resources

_PAPER = ["simplified-n100", "firat-n100", "simplified-n50", "firat-n50"]

# Walkers that broadcast twice a second and count their neighbours.
_WALK_PROGRAM = "firmware/examples/random_walk_counter.c"
_WALK_RANGE_M = 0.10
_SPEED_M_S = 0.010
_SPARSE_PER_M2 = 31.8
_RADIUS_M = PROFILES["kilobot"].radius_m
_DENSE_SHARE = 0.47  # of the area that robots cover
_DENSE_PER_M2 = _DENSE_SHARE / (math.pi * _RADIUS_M**2)
_WALK_S = {100: 20_000, 1_000: 2_000, 10_000: 300, 100_000: 100}  # simulated, by number of robots
_DENSE_S = 300
_SQUEEZE_PROGRAM = "experiments/bench/straight_on.c"
_SQUEEZE_ROBOTS = 1_000
_SQUEEZE_S = 300
_STILL: dict[str, float] = {"speed_spread": 0, "bias_spread": 0, "motor_noise": 0}
_MILLION, _MILLION_S = 1_000_000, 60
_WITH_THREADS = {"million"}  # as users run it: wall time counts
_MEMORY_S = 0.2
_MEDIA = ("kilobot", "ideal")
# Things that labs' programs do besides walking and talking, one thing each: `experiments/bench`.
# The program, and how many seconds are simulated.
_LIKE_LABS = {
    "silent": ("silent.c", 300),
    "seldom": ("seldom.c", 300),
    "period": ("period.c", 300),
    "waits": ("waits.c", 30),
    "delays": ("delays.c", 300),
    "computes": ("computes.c", 100),
    "state-1500": ("state_1500.c", 300),
}
_LIKE_LABS_ROBOTS, _KINDS_S = 1_000, 300
_KINDS_PROGRAM, _KINDS = "experiments/bench/kinds.c", 10
# Things that programs do in each pass of loop() and that keep a translated robot busy.
_SLOW = "experiments/bench/slow"
_SLOW_ROBOTS, _SLOW_S = 20, 10

_AVR_ROBOTS = 20
_AVR_S = 200
# A whole Kilogrid of 200 modules below walkers that report every two seconds. The host asks every
# module often enough that none of the ten records that it keeps is lost.
_GRID_ROBOTS, _GRID_S, _GRID_POLL_S = 50, 10_000, 10.0
_GRID_PROGRAM = "experiments/kilogrid/random_walk.c"

Tables = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """One row of the table."""

    workload: str
    experiment: Experiment
    alone: Experiment | None = None  # the same with one robot: take the bytes that others add


def _paper(settings: list[Setting]) -> Iterator[Case]:
    for name in _PAPER:
        file = resources.path(f"experiments/paper/{name}.toml")
        yield Case(f"paper/{name}", Experiment.load(file, settings))


def _walk(settings: list[Setting]) -> Iterator[Case]:
    for medium in _MEDIA:
        for robots, duration_s in _WALK_S.items():
            tables = _walkers(robots, _SPARSE_PER_M2, medium, duration_s)
            yield Case("walk", _experiment("walk", tables, settings))


def _dense(settings: list[Setting]) -> Iterator[Case]:
    for medium in _MEDIA:
        tables = _walkers(1_000, _DENSE_PER_M2, medium, _DENSE_S)
        yield Case("dense", _experiment("dense", tables, settings))


def _like_labs(workload: str, settings: list[Setting]) -> Iterator[Case]:
    """Walkers with a program of experiments/bench."""
    program, duration_s = _LIKE_LABS[workload]
    tables = _walkers(_LIKE_LABS_ROBOTS, _SPARSE_PER_M2, "kilobot", duration_s)
    tables["swarm"]["program"] = f"experiments/bench/{program}"
    yield Case(workload, _experiment(workload, tables, settings))


def _kinds(workload: str, settings: list[Setting]) -> Iterator[Case]:
    """Walkers with as many programs as there are kinds of them."""
    tables = _walkers(_LIKE_LABS_ROBOTS, _SPARSE_PER_M2, "kilobot", _KINDS_S)
    tables["swarm"] = {"profile": "kilobot"}
    count = _LIKE_LABS_ROBOTS // _KINDS
    tables["robots"] = [
        {"program": _KINDS_PROGRAM, "define": [f"KIND={kind}"], "count": count}
        for kind in range(_KINDS)
    ]
    yield Case(workload, _experiment(workload, tables, settings))


def _slow(settings: list[Setting]) -> Iterator[Case]:
    for program in sorted(resources.path(_SLOW).glob("*.c")):
        tables = _walkers(_SLOW_ROBOTS, _SPARSE_PER_M2, "kilobot", _SLOW_S)
        written = f"{_SLOW}/{program.name}"
        tables["swarm"] = {"profile": "kilobot"}
        tables["robots"] = [{"program": written, "cpu": "translated", "count": _SLOW_ROBOTS}]
        yield Case(f"slow/{program.stem}", _experiment("slow", tables, settings))


def _squeeze(settings: list[Setting]) -> Iterator[Case]:
    # On a spiral that fills a disc evenly, at 10 % of the area, all facing the middle.
    spacing_m = _RADIUS_M / math.sqrt(0.10)
    poses = []
    for robot in range(_SQUEEZE_ROBOTS):
        angle, radius = robot * math.pi * (3 - math.sqrt(5)), spacing_m * math.sqrt(robot + 0.5)
        heading = math.remainder(angle + math.pi, 2 * math.pi)
        poses.append([radius * math.cos(angle), radius * math.sin(angle), heading])
    diameter_m = 2 * (spacing_m * math.sqrt(_SQUEEZE_ROBOTS) + 5 * _RADIUS_M)
    tables = {
        "duration_s": _SQUEEZE_S,
        "arena": {"shape": "circle", "diameter_m": diameter_m},
        "swarm": {"profile": "kilobot"},
        "robots": [{"program": _SQUEEZE_PROGRAM, "count": _SQUEEZE_ROBOTS, "poses": poses}],
        "motion": {"speed_m_s": _SPEED_M_S, **_STILL},
        "record": {"sample_s": 100.0},
    }
    yield Case("squeeze", _experiment("squeeze", tables, settings))


def _transport(settings: list[Setting]) -> Iterator[Case]:
    """Robots that push an object, and are pushed against it: Box2D solves what is near it."""
    file = resources.path("experiments/objects/transport.toml")
    yield Case("transport", Experiment.load(file, settings))


def _million(settings: list[Setting]) -> Iterator[Case]:
    """The walk once more, with as many robots as anybody steps: it shall take a minute, too."""
    for medium in _MEDIA:
        tables = _walkers(_MILLION, _SPARSE_PER_M2, medium, _MILLION_S)
        yield Case("million", _experiment("million", tables, settings))


def _memory(settings: list[Setting]) -> Iterator[Case]:
    many, one = (
        _experiment("memory", _walkers(n, _SPARSE_PER_M2, "kilobot", _MEMORY_S), settings)
        for n in (_MILLION, 1)
    )
    yield Case("memory", many, one)


def _grid(settings: list[Setting]) -> Iterator[Case]:
    tables = {
        "duration_s": _GRID_S,
        "grid": {"columns": 10, "rows": 20, "poll_s": _GRID_POLL_S, "wall_cells": 0},
        "swarm": {"profile": "kilobot", "program": _GRID_PROGRAM, "size": _GRID_ROBOTS},
        "record": {"sample_s": 100.0},
    }
    yield Case("grid", _experiment("grid", tables, settings))


def _avr(settings: list[Setting]) -> Iterator[Case]:
    """Robots run from their .hex; 20 robot-seconds per CPU-second are 20 robots in real time."""
    tables = _walkers(_AVR_ROBOTS, _SPARSE_PER_M2, "kilobot", _AVR_S)
    tables["swarm"] = {"profile": "kilobot"}
    tables["robots"] = [{"program": _WALK_PROGRAM, "cpu": "avr", "count": _AVR_ROBOTS}]
    yield Case("avr", _experiment("avr", tables, settings))


# A workload is one entry here and one of bench.Workload.
_WORKLOADS: dict[str, Callable[[list[Setting]], Iterator[Case]]] = {
    "paper": _paper,
    "walk": _walk,
    "dense": _dense,
    **{workload: partial(_like_labs, workload) for workload in _LIKE_LABS},
    "slow": _slow,
    "programs-10": partial(_kinds, "programs-10"),
    "squeeze": _squeeze,
    "transport": _transport,
    "million": _million,
    "memory": _memory,
    "grid": _grid,
    "avr": _avr,
}


def _walkers(robots: int, per_m2: float, medium: str, duration_s: float) -> Tables:
    side_m = math.sqrt(robots / per_m2)
    return {
        "duration_s": duration_s,
        "arena": {"shape": "rectangle", "width_m": side_m, "height_m": side_m},
        "swarm": {"profile": "kilobot", "program": _WALK_PROGRAM, "size": robots},
        "motion": {"speed_m_s": _SPEED_M_S},
        "medium": {"kind": medium, "range_m": _WALK_RANGE_M},
        "reading": {"line_of_sight": False},
        "record": {"sample_s": 100.0},
    }


def _experiment(workload: str, tables: Tables, settings: list[Setting]) -> Experiment:
    named = {"name": f"bench {workload}", **tables, "swarm": {"cpu": "native", **tables["swarm"]}}
    return Experiment.of(ExperimentText(named["name"], Path.cwd(), named, "", settings))


def cases(
    workloads: list[str], duration_s: float | None, *, threads: int | None = None
) -> Iterator[Case]:
    """The rows of these workloads; `duration_s` in place of whole trials, with so many `threads`;
    without, and of a million robots, with as many as a run takes by itself."""
    settings = []
    if duration_s is not None:
        settings.append(Setting(("duration_s",), duration_s, f"--duration-s {duration_s:g}"))
    for workload in workloads:
        own = list(settings)
        if threads is not None and workload not in _WITH_THREADS:
            own.append(Setting(("engine", "threads"), threads, f"{threads} threads"))
        yield from _WORKLOADS[workload](own)
