"""`make mutants`: plants small faults, one at a time, and lists those that no test finds.

    python -m tests.mutants.run [--count 80 | --all] [--seed 1] [--group cores] [--file NAME]
                                [--minutes 60]

The faults are a sample that depends on count and seed alone. With --minutes they come in an order
drawn by the seed, and none is begun after that time: those that were judged are a smaller sample.
Each is planted into a copy of the tree in build/mutants, never into the sources; the tests of
targets.py are built and run there until one fails. Faults that do not compile count for nothing.
Survivors that cannot be told from the original, or that no test is worth, stand in survivors.toml
with the reason. The exit code is 1 if one survives that does not, or if fewer than 95 % are killed.
"""

import argparse
import json
import math
import random
import sys
import time
import tomllib
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path

from .mutations import Mutation, mutations
from .targets import GOLDEN_RUN, TARGETS, Target
from .workshop import FOLDER, ROOT, Verdict, Workshop

SURVIVORS = Path(__file__).with_name("survivors.toml")
LEAST_PERCENT = 95
SHARES = {"cores": 6, "channel": 2, "contact": 3, "writers": 4, "sweeps": 3}

Fault = tuple[Target, Mutation]


def faults_of(targets: Sequence[Target]) -> dict[str, list[Fault]]:
    """All faults that can be planted, by group."""
    found: dict[str, list[Fault]] = defaultdict(list)
    for target in targets:
        found[target.group] += [(target, fault) for fault in mutations(ROOT, target.file)]
    return found


def sample(faults: dict[str, list[Fault]], count: int, seed: int) -> list[Fault]:
    """`count` of them: of each group its share, or all it has; in the order of the files.

    A larger sample has the smaller one in it.
    """
    whole = sum(SHARES[group] for group in faults)
    chosen: list[Fault] = []
    for group, of_group in faults.items():
        wanted = min(len(of_group), round(count * SHARES[group] / whole))
        places = list(range(len(of_group)))
        random.Random(f"{seed} {group}").shuffle(places)
        chosen += [of_group[i] for i in sorted(places[:wanted])]
    return chosen


def reasons() -> dict[tuple[str, str, str], str]:
    """Why a survivor is one, by file, line before and line after."""
    entries = tomllib.loads(SURVIVORS.read_text())["survivor"] if SURVIVORS.exists() else []
    return {(e["file"], e["line"], e["becomes"]): e["reason"] for e in entries}


def key(fault: Mutation) -> tuple[str, str, str]:
    """How survivors.toml names a fault."""
    return fault.file, fault.text, fault.after


def show(verdict: Verdict, target: Target, fault: Mutation, reason: str | None) -> None:
    """A line for each fault, as soon as it is known what became of it."""
    what = verdict.what if reason is None or verdict.what != "survived" else "survived, with reason"
    by = f" by {verdict.by}" if verdict.by else ""
    where = f"{target.file}:{fault.line}"
    print(f"{what}{by} ({verdict.seconds:.0f} s): {where}\n    {fault.text}", flush=True)
    print(f"    {fault.after or '(removed)'}", flush=True)


def report(results: list[tuple[Verdict, Target, Mutation]], began: float) -> int:
    """The table at the end, and the exit code."""
    why = reasons()
    print()
    print("group     planted  killed  with a reason  survived")
    killed = excused = survived = 0
    for group in SHARES:
        of_group = [(v, f) for v, t, f in results if t.group == group and v.what != "invalid"]
        counts = Counter(v.what for v, _ in of_group)
        with_reason = sum(v.what == "survived" and key(f) in why for v, f in of_group)
        killed, excused = killed + counts["killed"], excused + with_reason
        left = counts["survived"] - with_reason
        survived += left
        row = (len(of_group), counts["killed"], with_reason, left)
        print(f"{group:8} {row[0]:8} {row[1]:7} {row[2]:14} {row[3]:9}")
    total = killed + excused + survived
    invalid = len(results) - total
    share = 100 * killed / max(1, total)
    print(f"{killed} of {total} killed: {share:.1f} %. {invalid} more did not compile.")
    by_hash = sum(v.by == GOLDEN_RUN for v, _, _ in results)
    print(f"{by_hash} of them only by the hash of a whole run, which must not change unmeant.")
    print(f"It took {(time.monotonic() - began) / 60:.0f} minutes.")
    # One of a small sample may stay.
    return 0 if survived == 0 and killed >= math.floor(LEAST_PERCENT * total / 100) else 1


def main() -> int:
    parser = argparse.ArgumentParser(prog="make mutants", description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=80)
    parser.add_argument("--all", action="store_true", help="every fault, which takes a day")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--group", choices=SHARES, action="append")
    parser.add_argument("--file", help="only files whose name has this in it")
    parser.add_argument("--line", help="only lines that have this in them")
    parser.add_argument("--minutes", type=float, help="begin no further fault after that time")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="of the copies and builds")
    parser.add_argument("--json", type=Path, help="results, for a program to read")
    arguments = parser.parse_args()

    began = time.monotonic()
    groups = arguments.group or list(SHARES)
    targets = [t for t in TARGETS if t.group in groups and (arguments.file or "") in t.file]
    faults = faults_of(targets)
    for group, of_group in faults.items():
        faults[group] = [fault for fault in of_group if (arguments.line or "") in fault[1].text]
    count = sum(map(len, faults.values())) if arguments.all else arguments.count
    chosen = sample(faults, count, arguments.seed)
    if arguments.all:
        chosen = [fault for of_group in faults.values() for fault in of_group]
    if arguments.minutes is not None:
        random.Random(arguments.seed).shuffle(chosen)
    print(f"{len(chosen)} of {sum(map(len, faults.values()))} faults, seed {arguments.seed}")
    workshop = Workshop(arguments.folder)
    why = reasons()
    results: list[tuple[Verdict, Target, Mutation]] = []
    end = math.inf if arguments.minutes is None else began + 60 * arguments.minutes
    for target, fault in chosen:
        if time.monotonic() > end:
            print(f"the time is over: {len(chosen) - len(results)} are left out")
            break
        verdict = workshop.judge(target, fault)
        show(verdict, target, fault, why.get(key(fault)))
        results.append((verdict, target, fault))
    if arguments.json:
        rows = [{"what": v.what, "by": v.by, **vars(f)} for v, _, f in results]
        arguments.json.write_text(json.dumps(rows, indent=1))
    return report(results, began)


if __name__ == "__main__":
    sys.exit(main())
