"""Holds the emulation against chips, logs of real robots and the paper, and writes what comes of it
into docs/truth.md: `make truth`, or some comparisons by name: `make truth ONLY="walk uplink"`.

`python -m tests.truth NAME...`, from the project's root.
"""

import argparse
import json
import shlex
import shutil
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.kept_table import ROOT, KeptTable, now

TABLE = KeptTable(
    ROOT / "docs/truth.md",
    ("comparison", "against", "commands", "measured", "figure", "bound", "verdict"),
)
BIN = Path(sys.executable).parent
RUNS = Path("runs/truth")


@dataclass(frozen=True)
class Found:
    """The result of a comparison."""

    figure: str
    holds: bool


@dataclass(frozen=True)
class Comparison:
    """Commands as a reader would type them; `read` gets what the last one printed."""

    name: str
    against: str
    commands: tuple[str, ...]
    bound: str
    read: Callable[[str], Found]


def proof(name: str, against: str, tests: str) -> Comparison:
    """Tests that compare; long ones among them."""
    report = RUNS / f"{name}.xml"
    words = f'pytest -q -m "long or not long" --junitxml={report} {tests}'

    def read(_: str) -> Found:
        suites = list(ET.parse(ROOT / report).getroot().iter("testsuite"))
        counts = {
            what: sum(int(suite.get(what, 0)) for suite in suites)
            for what in ("tests", "failures", "errors", "skipped")
        }
        ran = counts["tests"] - counts["skipped"]
        bad = counts["failures"] + counts["errors"]
        return Found(f"{ran - bad} of {ran} agree", ran > 0 and bad == 0)

    return Comparison(name, against, (words,), "all", read)


def run_and_compare(
    name: str, against: str, experiment: str, reference: str, bound: str
) -> Comparison:
    """One run of an experiment, compared with what is known of real robots."""
    path, *settings = experiment.split(" ", 1)
    folder = RUNS / name
    run = " ".join(["kilotwin run", path, *settings, f"--out {folder}"])
    compare = f"python -m tests.truth.against {reference} {folder} --json"
    read = {"kilogrid-uplink": uplink, "spacing": spacing, "real": real}[reference]
    return Comparison(
        name, against, (run, compare), bound, lambda text: read(json.loads(text.splitlines()[-1]))
    )


def uplink(found: Any) -> Found:
    figure = f"{found['rate']:.3f} records a robot and s, doubles {found['doubles']:.3f}"
    return Found(figure, found["within_bounds"])


def spacing(found: Any) -> Found:
    figure = f"share received off by {found['worst']:+.3f} at worst"
    return Found(figure, found["within_bounds"])


def real(found: Any) -> Found:
    judged = [row for row in found["rows"] if row["judged"]]
    inside = sum(row["within"] for row in judged)
    farthest = max(row["distance"] for row in judged)
    figure = f"{inside} of {len(judged)} measures within, the farthest at {farthest:.1f} bounds"
    return Found(figure, found["within_bounds"])


def paper(text: str) -> Found:
    verdicts = json.loads(text.splitlines()[-1])["verdicts"]
    figure = ", ".join(f"({claim}) {verdict}" for claim, verdict in verdicts.items())
    return Found(figure, set(verdicts.values()) == {"holds"})


COLLECTIVE = "experiments/kilogrid/collective-perception/collective-perception.toml"
COMPARISONS = (
    proof("instructions", "simavr", "tests/translation/test_instructions.py"),
    proof("chips-translated", "chips interpreted", "tests/translation/test_programs.py"),
    proof("robots-translated", "chip", "tests/translation/test_guests.py"),
    proof("robots-native", "chip", "tests/conformance"),
    run_and_compare(
        "uplink",
        "a real Kilogrid",
        "experiments/kilogrid/uplink-100.toml",
        "kilogrid-uplink",
        "as `python -m tests.truth.against kilogrid-uplink` says",
    ),
    run_and_compare(
        "spacing",
        "25 real robots, 5 cm apart, all sending",
        "experiments/calibration/spacing-25.toml",
        "spacing",
        "0.05 at each distance below the range",
    ),
    run_and_compare(
        "spacing-collisions",
        "25 real robots, 5 cm apart, all sending",
        "experiments/calibration/spacing-25.toml --set medium.loss=0 --set medium.loss_at_range=0",
        "spacing",
        "0.05 at each distance below the range",
    ),
    run_and_compare(
        "collective-perception-native",
        "8 logs of 100 real robots",
        f"{COLLECTIVE} --set swarm.cpu=native",
        "real",
        "95 % of one more real run, each measure",
    ),
    run_and_compare(
        "collective-perception-translated",
        "8 logs of 100 real robots",
        f"{COLLECTIVE} --set swarm.cpu=translated",
        "real",
        "95 % of one more real run, each measure",
    ),
    Comparison(
        "paper",
        "the paper's five claims",
        (
            f"kilotwin sweep experiments/paper/grid.toml --out {RUNS}/paper",
            f"python -m tests.truth.against paper {RUNS}/paper --json",
        ),
        "as docs/reproduce.md counts them",
        paper,
    ),
)


def main() -> int:
    """1 if one does not hold that was run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("only", nargs="*", metavar="NAME", help="one of: " + ", ".join(names()))
    wanted = parser.parse_args().only or names()
    if unknown := [name for name in wanted if name not in names()]:
        parser.error(f"there is no comparison '{unknown[0]}'; there are: {', '.join(names())}")
    good = True
    for comparison in COMPARISONS:
        if comparison.name in wanted:
            good = measured(comparison) and good
    return 0 if good else 1


def names() -> list[str]:
    return [comparison.name for comparison in COMPARISONS]


def measured(comparison: Comparison) -> bool:
    """Runs it and writes its row; the row stays as it was if a command is broken off."""
    began = time.monotonic()
    (ROOT / RUNS).mkdir(parents=True, exist_ok=True)
    shutil.rmtree(ROOT / RUNS / comparison.name, ignore_errors=True)
    text = ""
    for command in comparison.commands:
        print(f"$ {command}", flush=True)
        program, *words = shlex.split(command)
        done = subprocess.run(
            [BIN / program, *words], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False
        )
        disagrees = done.returncode == 1 and command == comparison.commands[-1]
        if done.returncode != 0 and not disagrees:
            print(f"{comparison.name}: broken off with code {done.returncode}\n", flush=True)
            return False
        text = done.stdout
    found = comparison.read(text)
    verdict = "holds" if found.holds else "**missed**"
    commands = "; ".join(f"`{command}`" for command in comparison.commands)
    cells = (comparison.against, commands, now(but=TABLE), found.figure, comparison.bound, verdict)
    TABLE.put(comparison.name, cells, names())
    took = f"{time.monotonic() - began:.0f} s"
    print(f"{comparison.name}: {found.figure}: {verdict} ({took})\n", flush=True)
    return found.holds


if __name__ == "__main__":
    sys.exit(main())
