"""How fast it is: robot-seconds per CPU-second on one core, as a user's own run has it."""

import math
import os
import platform
import signal
import statistics
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kilotwin.commands.terminal import Silent
from kilotwin.errors import InterruptError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.profile_defaults import PROFILES
from kilotwin.experiment.text import ExperimentText, Setting
from kilotwin.files import resources
from kilotwin.runs import run
from kilotwin.runs.interrupts import heeding_interrupts

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
_MEMORY_ROBOTS = 1_000_000
_MEMORY_S = 0.2
_MEDIA = ("kilobot", "ideal")

# Speed of others on the same workload, robot-s per CPU-s, taken as docs/performance.md describes;
# by workload and number of robots.
_PEERS: dict[tuple[str, int], tuple[str, int]] = {
    ("walk", 100): ("Kilombo", 484_000),
    ("walk", 1_000): ("Kilombo", 508_000),
    ("walk", 10_000): ("Kilombo", 234_000),
    ("dense", 1_000): ("Kilombo", 127_000),
    ("paper", 100): ("ARGoS foot-bot", 1_700),
    ("paper", 50): ("ARGoS Kilobot, the authors' code", 4_600),
}

_AVR_ROBOTS = 20
_AVR_S = 200
# A whole Kilogrid of 200 modules below walkers that report every two seconds. The host asks every
# module often enough that none of the ten records that it keeps is lost.
_GRID_ROBOTS, _GRID_S, _GRID_POLL_S = 50, 10_000, 10.0
_GRID_PROGRAM = "experiments/kilogrid/random_walk.c"

Note = Callable[[str], None]
Tables = dict[str, Any]
Columns = dict[str, Callable[[dict[str, Any]], str]]


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


def _memory(settings: list[Setting]) -> Iterator[Case]:
    many, one = (
        _experiment("memory", _walkers(n, _SPARSE_PER_M2, "kilobot", _MEMORY_S), settings)
        for n in (_MEMORY_ROBOTS, 1)
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
    "squeeze": _squeeze,
    "transport": _transport,
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
    named = {"name": f"bench {workload}", **tables}
    return Experiment.of(ExperimentText(named["name"], Path.cwd(), named, "", settings))


def cases(workloads: list[str], duration_s: float | None) -> Iterator[Case]:
    """The rows of these workloads; `duration_s` in place of whole trials."""
    settings = []
    if duration_s is not None:
        settings.append(Setting(("duration_s",), duration_s, f"--duration-s {duration_s:g}"))
    for workload in workloads:
        yield from _WORKLOADS[workload](settings)


def measure(
    workloads: list[str], repeats: int, duration_s: float | None, note: Note
) -> Iterator[dict[str, Any]]:
    """One record per case; each figure is the median over `repeats` runs.

    Interrupted, it gives none for the case of that moment, and no more.
    """
    # Between runs, too, a polite kill leaves what is measured.
    with heeding_interrupts(signal.default_int_handler):
        for case in cases(workloads, duration_s):
            yield _measure_one(case, repeats, note)


def _measure_one(case: Case, repeats: int, note: Note) -> dict[str, Any]:
    record: dict[str, Any] = dict.fromkeys(_FIELDS)
    record |= {"workload": case.workload, "repeats": repeats, "machine": machine()}
    experiment = case.experiment
    size, medium = experiment.size, experiment.keys.medium.kind
    summaries = []
    for repeat in range(repeats):
        note(f"{case.workload}, {size} robots, {medium}: run {repeat + 1} of {repeats}")
        summaries.append(_run(experiment))

    def median(key: str) -> float:
        return float(statistics.median(summary[key] for summary in summaries))

    record |= {
        "robots": size,
        "medium": medium,
        "worst_overlap_fraction": max(
            summary["stats"]["worst_overlap_fraction"] for summary in summaries
        ),
        "box2d_share": _box2d_share(summaries[0], size),
        "startup_s": round(median("startup_s"), 4),
        "simulated_s": summaries[0]["simulated_s"],
        "cpu_s": round(median("cpu_s"), 3),
    }
    if case.alone is not None:
        added = median("peak_bytes") - _run(case.alone)["peak_bytes"]
        record["bytes_per_robot"] = round(added / (size - 1))
        return record
    record["robot_s_per_cpu_s"] = round(median("robot_s_per_cpu_s"))
    peer = _PEERS.get((case.workload.split("/")[0], size))
    if peer is not None:
        record["peer"], record["peer_robot_s_per_cpu_s"] = peer
        record["times_the_peer"] = round(record["robot_s_per_cpu_s"] / peer[1], 2)
    return record


def _box2d_share(summary: dict[str, Any], robots: int) -> float:
    """Share of the robots' world steps that Box2D solved; the same in every run."""
    stats = summary["stats"]
    share: float = stats["island_steps"] / max(robots * stats["steps"], 1)
    return round(share, 6)


def _run(experiment: Experiment) -> dict[str, Any]:
    with tempfile.TemporaryDirectory(prefix="kilotwin-bench-") as scratch:
        folder = Path(scratch) / "run"
        outcome = run.run(experiment, folder, ["kilotwin", "bench"], Silent())
    if outcome.stop_asked:
        raise InterruptError("interrupted")
    return outcome.summary


def machine() -> str:
    """The processor, its cores, the system."""
    model = platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = cpuinfo.read_text().splitlines()
        model = next(
            (line.split(": ")[1] for line in lines if line.startswith("model name")), model
        )
    return f"{model}, {os.cpu_count()} cores, {platform.system()} {platform.release()}"


def table_text(results: list[dict[str, Any]]) -> str:
    """The results as a table, with the machine below."""
    lines = table_lines(_COLUMNS, results)
    repeats = results[0]["repeats"]
    return "\n".join([*lines, "", f"Medians of {repeats}; overlap in robot diameters. {machine()}"])


def table_lines(columns: Columns, results: list[dict[str, Any]]) -> list[str]:
    """A heading, and a line for each record; cells are aligned."""
    rows = [tuple(columns), *(tuple(show(r) for show in columns.values()) for r in results)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return [
        "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def _shown(key: str, pattern: str, scale: float = 1) -> Callable[[dict[str, Any]], str]:
    return lambda record: "-" if record[key] is None else pattern.format(scale * record[key])


_FIELDS = [
    "workload",
    "robots",
    "medium",
    "robot_s_per_cpu_s",
    "worst_overlap_fraction",
    "box2d_share",
    "bytes_per_robot",
    "startup_s",
    "simulated_s",
    "cpu_s",
    "peer",
    "peer_robot_s_per_cpu_s",
    "times_the_peer",
    "repeats",
    "machine",
]

_COLUMNS: Columns = {
    "workload": lambda record: str(record["workload"]),
    "robots": _shown("robots", "{:,}"),
    "medium": lambda record: record["medium"] or "-",
    "robot-s/CPU-s": _shown("robot_s_per_cpu_s", "{:,}"),
    "peer": _shown("peer_robot_s_per_cpu_s", "{:,}"),
    "ratio": _shown("times_the_peer", "{:.2f}"),
    "worst overlap": _shown("worst_overlap_fraction", "{:.2f} %", 100),
    "in Box2D": _shown("box2d_share", "{:.2f} %", 100),
    "bytes/robot": _shown("bytes_per_robot", "{:,}"),
    "start-up": _shown("startup_s", "{:.0f} ms", 1000),
}
