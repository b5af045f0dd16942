"""One run or sweep against what others measured: `python -m tests.truth.against REFERENCE FOLDER`.

References: `paper`, a sweep against the paper's claims; `update-time`, one against those of the
paper on the update time; `kilogrid-uplink`, a real Kilogrid; `spacing`, real robots 5 cm apart;
`real`, logs of collective perception, those whose figures the project carries or three and more of
your own (.kilodat or .kilodat.xz). Exits 1 outside the bounds.
"""

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from kilotwin.commands import steps
from kilotwin.errors import KilotwinError

from . import findings, kilogrid_uplink, paper, real_runs, spacing, update_time

Found = tuple[dict[str, Any], str, bool]
"""The --json object, the text, and whether it is within the bounds."""


def with_claims(
    check: Callable[..., dict[str, findings.Findings]], folder: Path, where: list[str]
) -> Found:
    """A sweep, held against what a paper says of its own. Good if some reading misses nothing."""
    readings = check(folder, where, steps.note(quiet=False))
    good = any(
        findings.MISSED not in findings.verdicts(found).values() for found in readings.values()
    )
    return findings.as_dict(readings), findings.report_text(readings), good


def with_robots(reference: Any, *given: Any) -> Found:
    """Compared by a module of references to real robots."""
    found = reference.compare(*given)
    return found.as_dict(), reference.report_text(found), found.within_bounds


REFERENCES: dict[str, Callable[[Path, list[str], list[Path]], Found]] = {
    "paper": lambda folder, where, _: with_claims(paper.check, folder, where),
    "update-time": lambda folder, where, _: with_claims(update_time.check, folder, where),
    "kilogrid-uplink": lambda folder, *_: with_robots(kilogrid_uplink, folder),
    "spacing": lambda folder, *_: with_robots(spacing, folder),
    "real": lambda folder, _, logs: with_robots(real_runs, folder, logs),
}


def main() -> int:
    """1 if it is not within the bounds, 2 for bad input."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("reference", choices=REFERENCES)
    parser.add_argument("folder", type=Path)
    parser.add_argument("logs", nargs="*", type=Path, help="real: three logs or more")
    parser.add_argument(
        "--where", action="append", default=[], metavar="COLUMN=VALUE", help="only such trials"
    )
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    if given.logs and given.reference != "real":
        parser.error(f"{given.logs[0]}: only real takes logs")
    if given.where and given.reference not in ("paper", "update-time"):
        parser.error(
            f"--where {given.where[0]}: only sweeps have trials, for paper and update-time"
        )
    try:
        found, text, good = REFERENCES[given.reference](given.folder, given.where, given.logs)
    except KilotwinError as error:
        sys.stderr.write(f"{error}\n")
        return error.exit_code
    sys.stdout.write((json.dumps(found) if given.json else text) + "\n")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
