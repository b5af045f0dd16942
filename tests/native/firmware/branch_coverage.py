"""Fails if a branch or a line of the given sources was never taken by the tests that just ran.

    branch_coverage.py clear BUILD_DIR            forget the counts of earlier runs
    branch_coverage.py check BUILD_DIR SOURCE...  report what was never taken

Reads the counts of gcc's --coverage through gcov.
"""

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any


def clear(build_dir: Path) -> int:
    for counts in build_dir.rglob("*.gcda"):
        counts.unlink()
    return 0


def gcov_files(build_dir: Path) -> list[dict[str, Any]]:
    """gcov's report of each source file of each object."""
    files: list[dict[str, Any]] = []
    for counts in sorted(build_dir.rglob("*.gcda")):
        command = ["gcov", "--branch-probabilities", "--json-format", "--stdout", str(counts)]
        output = subprocess.run(command, capture_output=True, check=True, text=True).stdout
        for line in output.splitlines():
            if line.strip():
                found = json.loads(line)
                # ccache makes the names relative to where the compiler ran.
                folder = Path(found["current_working_directory"])
                files += [{**file, "file": folder / file["file"]} for file in found["files"]]
    return files


def check(build_dir: Path, sources: list[Path]) -> int:
    lines: dict[Path, Counter[int]] = {source: Counter() for source in sources}
    branches: dict[Path, Counter[tuple[int, int]]] = {source: Counter() for source in sources}
    for file in gcov_files(build_dir):
        source = file["file"].resolve()
        if source not in lines:
            continue
        for line in file["lines"]:
            number = line["line_number"]
            lines[source][number] += line["count"]
            for index, branch in enumerate(line["branches"]):
                branches[source][number, index] += branch["count"]

    never = 0
    for source in sources:
        text = source.read_text().splitlines()
        missed = [n for n, count in lines[source].items() if count == 0]
        missed += [n for (n, _), count in branches[source].items() if count == 0]
        for number in sorted(set(missed)):
            print(f"{source}:{number}: never taken: {text[number - 1].strip()}")
        if not lines[source]:
            print(f"{source}: no counts at all: not built with --coverage, or no test ran")
        never += len(missed) + (not lines[source])
        print(f"{source.name}: {len(lines[source])} lines, {len(branches[source])} branches")
    print("every branch was taken" if never == 0 else f"{never} never taken")
    return int(never != 0)


def main() -> int:
    build_dir = Path(sys.argv[2])
    if sys.argv[1] == "clear":
        return clear(build_dir)
    return check(build_dir, [Path(source).resolve() for source in sys.argv[3:]])


if __name__ == "__main__":
    sys.exit(main())
