"""Compares two engines on one machine: this one and another checkout's, which take turns."""

import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from kilotwin.errors import InputError, RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.studies.bench.measure import Columns, Note, machine, table_lines
from kilotwin.studies.bench.turns import take_turns
from kilotwin.studies.bench.workloads import Case, cases

_SUMMARY, _ERRORS = "summary.json", "errors.txt"


@dataclass(frozen=True)
class _Engine:
    """A `kilotwin` to run. `name` is what messages call it."""

    name: str
    command: list[str]


def measure(
    workloads: list[str],
    folder: Path,
    rounds: int,
    duration_s: float | None,
    note: Note,
) -> Iterator[dict[str, Any]]:
    """One record per case. `folder` is a checkout with its own .venv (`make setup` there).

    Each round runs both engines, each as `kilotwin run` of its own checkout with its own copies of
    the programs: in turns of a tenth of a second, and every other round the other one first.
    `ratio` is the median over the rounds of new speed / old speed: above 1, this engine is faster.
    """
    command = folder.resolve() / ".venv" / "bin" / "kilotwin"
    if not command.exists():
        raise InputError(
            f"{folder}: has no .venv/bin/kilotwin; name another checkout, set up by: make setup"
        )
    other = _Engine(str(folder), [str(command)])
    this = _Engine("this engine", [sys.executable, "-P", "-m", "kilotwin"])
    with heeding_interrupts(signal.default_int_handler):
        for case in cases(workloads, duration_s):
            yield _measure_one(case, this, other, rounds, note)


def _measure_one(
    case: Case, this: _Engine, other: _Engine, rounds: int, note: Note
) -> dict[str, Any]:
    size, medium = case.experiment.size, case.experiment.keys.medium.kind
    new: list[dict[str, Any]] = []
    old: list[dict[str, Any]] = []
    turns = [(other, old), (this, new)]
    for number in range(1, rounds + 1):
        note(f"{case.workload}, {size} robots, {medium}: round {number} of {rounds}")
        found = _run([engine for engine, _ in turns], case.experiment)
        for (_, summaries), summary in zip(turns, found, strict=True):
            summaries.append(summary)
        turns.reverse()
    speeds = [
        a["robot_s_per_cpu_s"] / max(b["robot_s_per_cpu_s"], 1)
        for a, b in zip(new, old, strict=True)
    ]

    def median(summaries: list[dict[str, Any]], key: str) -> float:
        return float(statistics.median(summary[key] for summary in summaries))

    return {
        "workload": case.workload,
        "robots": size,
        "medium": medium,
        "ratio": round(statistics.median(speeds), 3),
        "ratio_min": round(min(speeds), 3),
        "ratio_max": round(max(speeds), 3),
        "robot_s_per_cpu_s": round(median(new, "robot_s_per_cpu_s")),
        "against_robot_s_per_cpu_s": round(median(old, "robot_s_per_cpu_s")),
        "memory_ratio": round(median(new, "peak_bytes") / max(median(old, "peak_bytes"), 1), 3),
        "same_results": len({_final_hash(summary) for summary in [*new, *old]}) == 1,
        "against": other.name,
        "rounds": rounds,
        "machine": machine(),
    }


def _final_hash(summary: dict[str, Any]) -> str:
    """Robots at the end; earlier engines called this hash their result's."""
    return str(summary.get("final_hash", summary["result_hash"]))


def _run(engines: list[_Engine], experiment: Experiment) -> list[dict[str, Any]]:
    """The summaries of one run by each engine, in their order; RunError if one fails."""
    with tempfile.TemporaryDirectory(prefix="kilotwin-bench-") as scratch:
        folders = [Path(scratch) / str(number) for number in range(len(engines))]
        runs = [_start(*one, experiment) for one in zip(engines, folders, strict=True)]
        failed = take_turns(runs)
        if failed is not None:
            number = runs.index(failed)
            cause = f"{engines[number].name}: `kilotwin run` ended with code {failed.returncode}"
            raise RunError(cause, detail=(folders[number] / _ERRORS).read_text().strip())
        return [json.loads((folder / _SUMMARY).read_text()) for folder in folders]


def _start(engine: _Engine, folder: Path, experiment: Experiment) -> "subprocess.Popen[str]":
    """A run in a new folder, into which it prints, too."""
    folder.mkdir()
    # From here relative programs are those of the engine's own checkout.
    (folder / "bench.toml").write_text(tomli_w.dumps(experiment.origin.raw))
    environment = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith("KILOTWIN_") or name == "KILOTWIN_CACHE"
    }
    words = ["run", "bench.toml", "--out", "run", "--json", "--quiet"]
    with (folder / _SUMMARY).open("w") as summary, (folder / _ERRORS).open("w") as errors:
        return subprocess.Popen(
            [*engine.command, *words],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=summary,
            stderr=errors,
            text=True,
        )


def table_text(results: list[dict[str, Any]]) -> str:
    """The results as a table, with the machine below."""
    first = results[0]
    return "\n".join(
        [
            *table_lines(_COLUMNS, results),
            "",
            f"Speed of this engine / that of {first['against']}: median of {first['rounds']} "
            f"rounds, in turns of a tenth of a second (lowest to highest). {first['machine']}",
        ]
    )


_COLUMNS: Columns = {
    "workload": lambda record: str(record["workload"]),
    "robots": lambda record: f"{record['robots']:,}",
    "medium": lambda record: record["medium"] or "-",
    "ratio": lambda record: (
        f"{record['ratio']:.2f} ({record['ratio_min']:.2f} to {record['ratio_max']:.2f})"
    ),
    "robot-s/CPU-s": lambda record: f"{record['robot_s_per_cpu_s']:,}",
    "against": lambda record: f"{record['against_robot_s_per_cpu_s']:,}",
    "memory": lambda record: f"{record['memory_ratio']:.2f}",
    "same results": lambda record: "yes" if record["same_results"] else "NO",
}
