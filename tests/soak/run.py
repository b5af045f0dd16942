"""`make check-long`: the long tests, piece by piece, and when each last passed.

    python -m tests.soak.run [PIECE ...]      all pieces, or those
    python -m tests.soak.run --list

A piece that passes writes its line of docs/soak.md: the day, the commit, and how long it took.
"""

import argparse
import subprocess
import sys
import time

from tests.kept_table import ROOT, KeptTable, now

from .pieces import PIECES

TABLE = KeptTable(ROOT / "docs/soak.md", ("piece", "shows", "last passed", "took"))


def passes(name: str) -> bool:
    """Runs a piece."""
    command = [sys.executable, "-m", "pytest", "-m", "long", "-p", "no:cacheprovider"]
    return (
        subprocess.run([*command, *PIECES[name].selectors], cwd=ROOT, check=False).returncode == 0
    )


def main() -> int:
    parser = argparse.ArgumentParser(prog="make check-long", description=__doc__.split("\n")[0])
    parser.add_argument("pieces", nargs="*", metavar="PIECE")
    parser.add_argument("--list", action="store_true", help="say which pieces there are")
    arguments = parser.parse_args()
    for unknown in set(arguments.pieces) - set(PIECES):
        parser.error(f"{unknown} is none of {', '.join(PIECES)}")
    if arguments.list:
        for name, piece in PIECES.items():
            print(f"{name:20} {piece.minutes:3} min  {piece.shows}")
        return 0
    failed = []
    for name in arguments.pieces or PIECES:
        print(f"== {name}: {PIECES[name].shows}", flush=True)
        at, began = now(but=TABLE), time.monotonic()
        if not passes(name):
            failed.append(name)
            continue
        minutes = (time.monotonic() - began) / 60
        TABLE.put(name, (PIECES[name].shows, at, f"{minutes:.0f} min"), list(PIECES))
    if failed:
        print(f"failed: {', '.join(failed)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
