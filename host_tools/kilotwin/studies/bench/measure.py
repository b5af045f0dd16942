"""How fast it is: robot-seconds per CPU-second, as a user's own run has it."""

import os
import platform
import signal
import statistics
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from kilotwin import _emulator
from kilotwin.errors import InterruptError
from kilotwin.experiment.experiment import Experiment
from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.session import run
from kilotwin.session.display import Silent
from kilotwin.session.job import threads_for
from kilotwin.studies.bench.workloads import Case, cases

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

Note = Callable[[str], None]
Columns = dict[str, Callable[[dict[str, Any]], str]]


def measure(
    workloads: list[str], repeats: int, duration_s: float | None, note: Note
) -> Iterator[dict[str, Any]]:
    """One record per case; each figure is the median over `repeats` runs.

    Interrupted, it gives none for the case of that moment, and no more.
    """
    # Between runs, too, a polite kill leaves what is measured.
    with heeding_interrupts(signal.default_int_handler):
        for case in cases(workloads, duration_s, threads=1):
            yield _measure_one(case, repeats, note)


def _measure_one(case: Case, repeats: int, note: Note) -> dict[str, Any]:
    record: dict[str, Any] = dict.fromkeys(_FIELDS)
    record |= {"workload": case.workload, "repeats": repeats, "machine": machine()}
    experiment = case.experiment
    size, medium = experiment.size, experiment.keys.medium.kind
    summaries, loops_s = [], []
    for repeat in range(repeats):
        note(f"{case.workload}, {size} robots, {medium}: run {repeat + 1} of {repeats}")
        before_s = _emulator.reference_loop_s()
        summary = _run(experiment)
        # How fast the machine was: it may change from minute to minute.
        loop_s = statistics.mean([before_s, _emulator.reference_loop_s()])
        summaries.append(summary | {"robot_s_per_loop": summary["robot_s_per_cpu_s"] * loop_s})
        loops_s.append(loop_s)

    def median(key: str) -> float:
        return float(statistics.median(summary[key] for summary in summaries))

    record |= {
        "robots": size,
        "medium": medium,
        "worst_overlap_fraction": max(
            summary["stats"]["worst_overlap_fraction"] for summary in summaries
        ),
        "island_share": _island_share(summaries[0], size),
        "startup_s": round(median("startup_s"), 4),
        "threads": threads_for(experiment),
        "simulated_s": summaries[0]["simulated_s"],
        "cpu_s": round(median("cpu_s"), 3),
        "wall_s": round(median("wall_s"), 3),
        "loop_s": round(statistics.median(loops_s), 4),
    }
    if case.alone is not None:
        added = median("peak_bytes") - _run(case.alone)["peak_bytes"]
        record["bytes_per_robot"] = round(added / (size - 1))
        return record
    record["robot_s_per_cpu_s"] = round(median("robot_s_per_cpu_s"))
    record["robot_s_per_loop"] = round(median("robot_s_per_loop"))
    peer = _PEERS.get((case.workload.split("/")[0], size))
    if peer is not None:
        record["peer"], record["peer_robot_s_per_cpu_s"] = peer
        record["times_the_peer"] = round(record["robot_s_per_cpu_s"] / peer[1], 2)
    return record


def _island_share(summary: dict[str, Any], robots: int) -> float:
    """Share of the robots' world steps in islands, which a solver moved; the same in every run."""
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
    told = (
        f"Medians of {repeats}; loop: the reference loop; overlap in robot diameters; CPU time of "
        "all threads; wall time with start-up."
    )
    return "\n".join([*lines, "", f"{told} {machine()}"])


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
    "robot_s_per_loop",
    "worst_overlap_fraction",
    "island_share",
    "bytes_per_robot",
    "startup_s",
    "threads",
    "simulated_s",
    "cpu_s",
    "wall_s",
    "loop_s",
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
    "robot-s/loop": _shown("robot_s_per_loop", "{:,}"),
    "peer": _shown("peer_robot_s_per_cpu_s", "{:,}"),
    "ratio": _shown("times_the_peer", "{:.2f}"),
    "worst overlap": _shown("worst_overlap_fraction", "{:.2f} %", 100),
    "in islands": _shown("island_share", "{:.2f} %", 100),
    "bytes/robot": _shown("bytes_per_robot", "{:,}"),
    "start-up": _shown("startup_s", "{:.0f} ms", 1000),
    "threads": _shown("threads", "{}"),
    "simulated": _shown("simulated_s", "{:,.0f} s"),
    "wall": _shown("wall_s", "{:,.1f} s"),
}
