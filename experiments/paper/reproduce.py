"""Runs what decides the paper's claims (a) and (e), and five conditions of its grid.

    .venv/bin/python experiments/paper/reproduce.py [--seeds N] [--out DIR] [--only a|cells]

Runs are made one after another, each in a folder of DIR. One that is there is not made again, so a
stopped script goes on where it was. Tables go to stdout as Markdown, progress to stderr.
What they mean is said in docs/reproduce.md.
"""

import argparse
import json
import random
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import comb
from pathlib import Path
from statistics import fmean, median, quantiles
from typing import Any

HERE = Path(__file__).resolve().parent
KILOTWIN = Path(sys.executable).parent / "kilotwin"

RULES = ("simplified", "firat")
SIZES = (50, 100)
SHARES = ((0.1, 0.5), (0.2, 0.6), (0.3, 0.7), (0.4, 0.9), (0.5, 1.0))  # (rho_I, rho_sb)

# Where claim (c) says that the simplified controller is nearer: N, and the conditions there.
REGIONS = (
    ("rho_I > 0.3, rho_sb > 0.8", 50, SHARES[3:]),
    ("rho_I > 0.3, rho_sb > 0.8", 100, SHARES[3:]),
    ("rho_I < 0.3, rho_sb < 0.7", 100, SHARES[:2]),
)


@dataclass(frozen=True)
class Condition:
    """One cell of the grid: `informed` is rho_I, `black` is rho_sb."""

    rule: str
    robots: int
    informed: float = 0
    black: float = 0

    @property
    def name(self) -> str:
        shares = f"{self.informed}-{self.black}" if self.informed else "0"
        return f"{self.rule}-n{self.robots}-{shares}"

    def command(self, seed: int, folder: Path) -> list[str]:
        settings = [f"swarm.informed={self.informed}"]
        if self.informed:
            settings.append(f"swarm.informed_for.black={self.black}")
            settings.append(f"swarm.informed_for.white={round(1 - self.black, 3)}")
        return [
            *(str(KILOTWIN), "run", str(HERE / f"{self.rule}-n{self.robots}.toml")),
            *(word for setting in settings for word in ("--set", setting)),
            *("--seed", str(seed), "--out", str(folder), "--json", "--quiet"),
        ]


@dataclass(frozen=True)
class Result:
    """How a run ended: robots resting on each site, and nowhere."""

    black: int
    white: int
    nowhere: int
    contacts: int
    cpu_s: float
    made_by: str

    def error(self, target_black: float) -> float:
        """Robots too many or too few on a site, averaged over both sites."""
        target_white = self.black + self.white + self.nowhere - target_black
        return (abs(self.black - target_black) + abs(self.white - target_white)) / 2


@dataclass(frozen=True)
class Interval:
    """A value and its 95 % interval."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{round(self.value, 2):g} [{round(self.low, 2):g}, {round(self.high, 2):g}]"


def is_one_aggregate(black: int, white: int) -> bool:
    """Whether the larger site holds at least 90 % of the resting robots."""
    return max(black, white) > 0 and 10 * max(black, white) >= 9 * (black + white)


def share_interval(hits: int, trials: int) -> Interval:
    """The exact (Clopper-Pearson) two-sided 95 % interval of a share."""

    def lowest_share(count: int) -> float:
        """The share with which `count` or more of the trials hit in 2.5 % of the cases."""
        if count == 0:
            return 0.0
        low, high = 0.0, 1.0
        for _ in range(60):
            p = (low + high) / 2
            tail = sum(
                comb(trials, k) * p**k * (1 - p) ** (trials - k) for k in range(count, trials + 1)
            )
            low, high = (p, high) if tail < 0.025 else (low, p)
        return low

    return Interval(hits / trials, lowest_share(hits), 1 - lowest_share(trials - hits))


def bootstrap(
    groups: Sequence[Sequence[float]],
    statistic: Callable[[Sequence[Sequence[float]]], float],
    resamples: int = 5000,
) -> Interval:
    """A statistic and its 95 % interval (percentiles); every group is resampled by itself."""
    chance = random.Random(1)  # the same table every time
    values = sorted(
        statistic([chance.choices(group, k=len(group)) for group in groups])
        for _ in range(resamples)
    )
    return Interval(statistic(groups), values[resamples // 40], values[-resamples // 40])


def mean_difference(groups: Sequence[Sequence[float]]) -> float:
    """Mean of the groups 0, 2, 4, ... less that of 1, 3, 5, ..., every group with equal weight."""
    means = [fmean(group) for group in groups]
    return fmean(means[0::2]) - fmean(means[1::2])


def spread(values: Sequence[float]) -> float:
    """The interquartile range, quartiles interpolated as numpy does."""
    if len(values) < 2:
        return 0.0
    first, _, third = quantiles(values, n=4, method="inclusive")
    return third - first


def verdict_a(share: Interval, median_nowhere: float) -> str:
    """Claim (a): lower bound of the share above 0.5, median resting nowhere 4 +- 2."""
    misses = []
    if share.low <= 0.5:
        misses.append(f"lower bound {share.low:.2f} is not above 0.5")
    if not 2 <= median_nowhere <= 6:
        misses.append(f"median {median_nowhere:g} is not within 2 to 6")
    return "missed: " + ", ".join(misses) if misses else "holds"


def verdict_c(nearer_by: Interval) -> str:
    """Claim (c) in one region, given the error of Firat minus that of simplified."""
    if nearer_by.low > 0:
        return "simplified nearer"
    return "Firat nearer" if nearer_by.high < 0 else "undecided"


def finished(stem: Path) -> Result | None:
    """The result of a run that is there already; None if it has yet to be made."""
    try:
        summary: dict[str, Any] = json.loads(stem.with_name(stem.name + ".json").read_text())
        engine = json.loads((stem / "manifest.json").read_text())["engine"]
    except FileNotFoundError:
        return None
    return Result(
        summary["resting"]["black"],
        summary["resting"]["white"],
        summary["not_resting"],
        summary["stats"]["contacts"],
        summary["cpu_s"],
        f"kilotwin {engine['version']} ({engine['build']}), Box2D {engine['box2d']}",
    )


def make(condition: Condition, seed: int, stem: Path) -> Result:
    """Makes one run; its JSON comes last. What an interrupted one left is removed first."""
    if (stem / "manifest.json").is_file():
        shutil.rmtree(stem)
    done = subprocess.run(condition.command(seed, stem), stdout=subprocess.PIPE, check=True)
    draft = stem.with_name(stem.name + ".json.new")
    draft.write_bytes(done.stdout)
    draft.replace(stem.with_name(stem.name + ".json"))
    result = finished(stem)
    assert result, stem
    return result


def run_all(
    conditions: Iterable[Condition], seeds: range, out: Path
) -> dict[Condition, list[Result]]:
    """All runs, seed by seed, so that a stopped script has a little of everything."""
    jobs = [(condition, seed) for seed in seeds for condition in conditions]
    stems = {job: out / f"{job[0].name}-s{job[1]}" for job in jobs}
    there = {job: finished(stem) for job, stem in stems.items()}
    to_do = [job for job in jobs if there[job] is None]
    say(f"{len(jobs)} runs, {len(jobs) - len(to_do)} of them already in {out}")

    began, robots_done = time.monotonic(), 0
    for number, job in enumerate(to_do, 1):
        condition, seed = job
        result = there[job] = make(condition, seed, stems[job])
        robots_done += condition.robots
        robots_left = sum(left.robots for left, _ in to_do[number:])
        minutes = (time.monotonic() - began) / robots_done * robots_left / 60
        say(
            f"{number}/{len(to_do)} {stems[job].name}: black {result.black}, white {result.white}, "
            f"nowhere {result.nowhere}; {minutes:.0f} min left"
        )

    results: dict[Condition, list[Result]] = {}
    for (condition, _), found in there.items():
        assert found
        results.setdefault(condition, []).append(found)
    return results


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def median_and_spread(values: Sequence[float]) -> str:
    return f"{median(values):g} ({spread(values):g})"


def table_a(results: Sequence[Result]) -> str:
    nowhere = [result.nowhere for result in results]
    winners = [run.black > run.white for run in results if is_one_aggregate(run.black, run.white)]
    share = share_interval(len(winners), len(results))
    runs = (
        f"{len(winners)} of {len(results)} ({sum(winners)} black, {winners.count(False)} white): "
        f"{share}"
    )
    split = [
        max(run.black, run.white) / max(1, run.black + run.white)
        for run in results
        if not is_one_aggregate(run.black, run.white)
    ]
    middle = bootstrap([nowhere], lambda groups: median(groups[0]))
    width = bootstrap([nowhere], lambda groups: spread(groups[0]))
    rows = [
        ("runs with one aggregate", runs, "again and again"),
        ("larger site's share in the others, median", f"{median(split):.2f}" if split else "-", ""),
        ("resting nowhere, median", str(middle), "4"),
        ("resting nowhere, interquartile range", str(width), "5"),
        ("claim (a)", verdict_a(share, median(nowhere)), ""),
    ]
    return table(("simplified, N = 100, rho_I = 0", "here [95 % interval]", "paper"), rows)


def table_cells(results: dict[Condition, list[Result]]) -> str:
    rows = []
    for robots in SIZES:
        for informed, black in SHARES:
            target = robots * black
            row = [str(robots), f"{informed}, {black}", f"{target:g} / {robots - target:g}"]
            for rule in RULES:
                runs = results[Condition(rule, robots, informed, black)]
                on_black = median_and_spread([run.black for run in runs])
                on_white = median_and_spread([run.white for run in runs])
                error = fmean(run.error(target) for run in runs)
                row += [f"{on_black} / {on_white}", f"{error:.1f}"]
            rows.append(row)
    header = ["N", "rho_I, rho_sb", "target", "simplified", "error", "Firat", "error"]
    return table(header, rows)


def table_c(results: dict[Condition, list[Result]]) -> str:
    rows = []
    for name, robots, shares in REGIONS:
        errors = [
            [run.error(robots * black) for run in results[Condition(rule, robots, informed, black)]]
            for informed, black in shares
            for rule in ("firat", "simplified")
        ]
        nearer_by = bootstrap(errors, mean_difference)
        rows.append((str(robots), name, str(nearer_by), verdict_c(nearer_by)))
    header = ("N", "region", "error of Firat minus simplified [95 % interval]", "in these cells")
    return table(header, rows)


def table_e(results: dict[Condition, list[Result]]) -> str:
    rows = []
    for robots in SIZES:
        resting = [run.black + run.white for run in results[Condition("firat", robots)]]
        number = f"{sum(n > 0 for n in resting)} of {len(resting)}"
        rows.append((str(robots), number, str(max(resting)), "missed" if any(resting) else "holds"))
    header = ("N", "Firat, rho_I = 0: runs with a resting robot", "most resting", "claim (e)")
    return table(header, rows)


def origin(results: dict[Condition, list[Result]]) -> str:
    """One line: what made these runs and what they cost."""
    runs = [run for several in results.values() for run in several]
    makers = sorted({run.made_by for run in runs})
    minutes = sum(run.cpu_s for run in runs) / 60
    contacts = sum(run.contacts for run in runs)
    return (
        f"{len(runs)} runs by {' and '.join(makers)}; {minutes:.0f} min of CPU time; "
        f"{contacts} contacts between bodies in all.\n"
    )


def say(text: str) -> None:
    sys.stderr.write(text + "\n")


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=20, metavar="N", help="1 to N; default 20")
    parser.add_argument("--out", type=Path, default=Path("runs/reproduce"), metavar="DIR")
    parser.add_argument("--only", choices=("a", "cells"), help="claim (a), or the rest")
    arguments = parser.parse_args()
    if arguments.seeds < 1:
        parser.error("--seeds: at least 1")
    try:
        arguments.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        parser.error(f"--out {arguments.out}: {error.strerror}; name another folder")

    for_a = Condition("simplified", 100)
    cells = [Condition(rule, n, *shares) for shares in SHARES for rule in RULES for n in SIZES]
    cells += [Condition("firat", n) for n in SIZES]
    wanted = {"a": [for_a], "cells": cells, None: [for_a, *cells]}[arguments.only]
    try:
        results = run_all(wanted, range(1, arguments.seeds + 1), arguments.out)
    except subprocess.CalledProcessError as error:
        say(f"A run failed with exit code {error.returncode}; finished ones are in {arguments.out}")
        return 1
    except KeyboardInterrupt:
        say(f"Stopped. The same command goes on from what is in {arguments.out}")
        return 130

    tables = [table_a(results[for_a])] if for_a in results else []
    if arguments.only != "a":
        tables += [table_cells(results), table_c(results), table_e(results)]
    sys.stdout.write("\n".join([*tables, origin(results)]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
