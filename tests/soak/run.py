"""`make check-long`: the long tests, piece by piece, and when each last passed.

    python -m tests.soak.run [PIECE ...]      all pieces, or those
    python -m tests.soak.run --list

A piece that passes writes its line of docs/soak.md: the day, the commit, and how long it took.
"""

import argparse
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

from .pieces import PIECES

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "docs/soak.md"
NEVER = "never"


def row(name: str, day: str = NEVER, commit: str = "", took: str = "") -> str:
    """A piece's line."""
    return f"| {name} | {PIECES[name].shows} | {day} | {commit} | {took} |"


def with_row(text: str, name: str, line: str) -> str:
    """The table with a piece's line in the place of the old one, or behind the last one."""
    lines = text.rstrip("\n").split("\n")
    places = [i for i, old in enumerate(lines) if old.startswith(f"| {name} |")]
    if places:
        lines[places[0]] = line
    else:
        lines.append(line)
    return "\n".join(lines) + "\n"


def commit() -> str:
    """The commit, with a + if the tree differs from it in more than the table."""
    head = subprocess.check_output(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, text=True)
    changed = ["git", "status", "--porcelain", "--", ".", f":!{TABLE.relative_to(ROOT)}"]
    return head.strip() + ("+" if subprocess.check_output(changed, cwd=ROOT) else "")


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
        at, began = commit(), time.monotonic()
        if not passes(name):
            failed.append(name)
            continue
        minutes = (time.monotonic() - began) / 60
        line = row(name, f"{datetime.now(UTC):%Y-%m-%d}", at, f"{minutes:.0f} min")
        TABLE.write_text(with_row(TABLE.read_text(), name, line))
    if failed:
        print(f"failed: {', '.join(failed)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
