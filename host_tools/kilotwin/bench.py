"""How fast it is: robot-seconds per CPU-second on one core, as a user's own run has it."""

import math
import os
import platform
import statistics
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from kilotwin import resources, run
from kilotwin.experiment import Experiment
from kilotwin.experiment_text import ExperimentText, Setting
from kilotwin.terminal import Silent

_PAPER = ["simplified-n100", "firat-n100", "simplified-n50", "firat-n50"]

# Walkers that broadcast twice a second and count their neighbours: robots, simulated seconds.
_WALK_PROGRAM = "firmware/examples/random_walk_counter.c"
_WALK_PER_M2 = 31.8
_WALK_RANGE_M = 0.10
_WALK_SPEED_M_S = 0.010
_WALK_SIZES = {100: 20_000, 1_000: 2_000, 10_000: 200}

_AVR_ROBOTS = 20
_AVR_DURATION_S = 200

Note = Callable[[str], None]


def _paper(settings: list[Setting]) -> Iterator[tuple[str, Experiment]]:
    for name in _PAPER:
        file = resources.path(f"experiments/paper/{name}.toml")
        yield f"paper/{name}", Experiment.load(file, settings)


def _walk(settings: list[Setting]) -> Iterator[tuple[str, Experiment]]:
    for medium in ("kilobot", "ideal"):
        for robots, duration_s in _WALK_SIZES.items():
            side_m = math.sqrt(robots / _WALK_PER_M2)
            tables = {
                "name": f"walk, N = {robots}",
                "duration_s": duration_s,
                "arena": {"shape": "rectangle", "width_m": side_m, "height_m": side_m},
                "swarm": {"profile": "kilobot", "program": _WALK_PROGRAM, "size": robots},
                "motion": {"speed_m_s": _WALK_SPEED_M_S},
                "medium": {"kind": medium, "range_m": _WALK_RANGE_M},
                "record": {"sample_s": 100.0},
            }
            origin = ExperimentText("bench walk", Path.cwd(), tables, {}, settings)
            yield f"walk/{medium}-n{robots}", Experiment.of(origin)


def _avr(settings: list[Setting]) -> Iterator[tuple[str, Experiment]]:
    """Robots run from their .hex; 20 robot-seconds per CPU-second are 20 robots in real time."""
    side_m = math.sqrt(_AVR_ROBOTS / _WALK_PER_M2)
    tables = {
        "name": f"avr, N = {_AVR_ROBOTS}",
        "duration_s": _AVR_DURATION_S,
        "arena": {"shape": "rectangle", "width_m": side_m, "height_m": side_m},
        "swarm": {"profile": "kilobot"},
        "robots": [{"program": _WALK_PROGRAM, "cpu": "avr", "count": _AVR_ROBOTS}],
        "motion": {"speed_m_s": _WALK_SPEED_M_S},
        "medium": {"kind": "kilobot", "range_m": _WALK_RANGE_M},
        "record": {"sample_s": 100.0},
    }
    origin = ExperimentText("bench avr", Path.cwd(), tables, {}, settings)
    yield f"avr/walk-n{_AVR_ROBOTS}", Experiment.of(origin)


# A whole Kilogrid of 200 modules below walkers that report every two seconds. The host asks every
# module often enough that none of the ten records that it keeps is lost.
_GRID_ROBOTS, _GRID_S, _GRID_POLL_S = 50, 2_000, 10.0


def _grid(settings: list[Setting]) -> Iterator[tuple[str, Experiment]]:
    tables = {
        "name": f"grid, N = {_GRID_ROBOTS}",
        "duration_s": _GRID_S,
        "grid": {"columns": 10, "rows": 20, "poll_s": _GRID_POLL_S, "wall_cells": 0},
        "swarm": {
            "profile": "kilobot",
            "program": "experiments/kilogrid/random_walk.c",
            "size": _GRID_ROBOTS,
        },
        "record": {"sample_s": 100.0},
    }
    origin = ExperimentText("bench grid", Path.cwd(), tables, {}, settings)
    yield f"grid/200-modules-n{_GRID_ROBOTS}", Experiment.of(origin)


_WORKLOADS = {"paper": _paper, "walk": _walk, "grid": _grid, "avr": _avr}


def measure(
    workloads: list[str], repeats: int, duration_s: float | None, note: Note
) -> list[dict[str, Any]]:
    """One record per experiment; each figure is the median over `repeats` runs."""
    settings = []
    if duration_s is not None:
        settings.append(Setting(("duration_s",), duration_s, f"--duration-s {duration_s:g}"))
    return [
        _measure_one(name, experiment, repeats, note)
        for workload in workloads
        for name, experiment in _WORKLOADS[workload](settings)
    ]


def _measure_one(name: str, experiment: Experiment, repeats: int, note: Note) -> dict[str, Any]:
    summaries = []
    for repeat in range(repeats):
        note(f"{name}, run {repeat + 1} of {repeats}")
        with tempfile.TemporaryDirectory(prefix="kilotwin-bench-") as scratch:
            outcome = run.run(experiment, Path(scratch) / "run", ["kilotwin", "bench"], Silent())
        summaries.append(outcome.summary)

    def median(key: str) -> float:
        return float(statistics.median(summary[key] for summary in summaries))

    return {
        "workload": name,
        "robots": experiment.size,
        "medium": experiment.keys.medium.kind,
        "robot_s_per_cpu_s": round(median("robot_s_per_cpu_s")),
        "worst_overlap_fraction": max(
            summary["stats"]["worst_overlap_fraction"] for summary in summaries
        ),
        "bytes_per_robot": None,
        "startup_s": round(median("startup_s"), 4),
        "simulated_s": summaries[0]["simulated_s"],
        "cpu_s": round(median("cpu_s"), 3),
        "repeats": repeats,
        "machine": machine(),
    }


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
    rows = [("workload", "robots", "medium", "robot-s/CPU-s", "worst overlap", "start-up")]
    rows += [
        (
            result["workload"],
            str(result["robots"]),
            result["medium"],
            f"{result['robot_s_per_cpu_s']:,}",
            f"{100 * result['worst_overlap_fraction']:.2f} %",
            f"{1000 * result['startup_s']:.0f} ms",
        )
        for result in results
    ]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = [
        "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True))
        for row in rows
    ]
    repeats = results[0]["repeats"]
    return "\n".join([*lines, "", f"Medians of {repeats}; overlap in robot diameters. {machine()}"])
