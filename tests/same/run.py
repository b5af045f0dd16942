"""Steps all scenes by engines of two compilers, with 1, 2, 3 and 8 threads: `make same`.

One engine is the installed one; the other is built from the same sources by the other compiler, as
are the robots' programs that it runs. It prints a line for each scene, and ends with code 1 where
anything differs.
"""

import sys
import tempfile
from pathlib import Path

from kilotwin import _emulator

from .engines import build_engine, outcomes, taking


def main() -> int:
    """The exit code."""
    own, other = ("clang", "gcc") if _emulator.BUILD.startswith("Clang") else ("gcc", "clang")
    print(f"same: building the engine by {other} (minutes, the first time)", file=sys.stderr)
    build = build_engine(other, "-O3")
    with tempfile.TemporaryDirectory(prefix="kilotwin-same-") as folder:
        told = {
            own: outcomes(variables={"KILOTWIN_CC": own}),
            other: outcomes(variables={"KILOTWIN_CC": other, **taking(build, Path(folder))}),
        }
    for compiler, outcome in told.items():
        print(f"{compiler}: {outcome['build']}")
    bad = 0
    for scene, by_threads in told[own]["outcomes"].items():
        every = {
            f"{compiler}, {threads} threads": digest
            for compiler, outcome in told.items()
            for threads, digest in outcome["outcomes"][scene].items()
        }
        if len(set(every.values())) == 1:
            numbers = ", ".join(by_threads)
            print(f"{scene:<20} {next(iter(every.values()))}  {own} = {other}; threads {numbers}")
            continue
        bad += 1
        print(f"{scene:<20} DIFFERS: {'; '.join(f'{name} {one}' for name, one in every.items())}")
    print("all the same" if not bad else f"{bad} scenes differ")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
