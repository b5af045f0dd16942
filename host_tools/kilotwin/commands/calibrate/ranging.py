"""`kilotwin calibrate ranging`: gain tables of pairs of robots, at distances that a jig sets."""

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from kilotwin.commands import keyboard, steps
from kilotwin.commands.calibrate.motors import EMULATED, LabFile, MotorsVia
from kilotwin.commands.options import Buses, Json, Quiet, Size
from kilotwin.commands.robots_via import link_to_robots
from kilotwin.errors import EXIT_ROBOTS_FAILED, DeviceError, InputError, InterruptError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.section import LAST_UID
from kilotwin.files.headers import GAIN_DISTANCES_MM
from kilotwin.session.emulated_jig import EmulatedJig
from kilotwin.table.flash.progress import stepwise
from kilotwin.table.lab import lab_store
from kilotwin.table.lab.gain_tables import errors_mm, mean_of, reach_mm
from kilotwin.table.lab.lab_store import Entry
from kilotwin.table.lab.ranging import READINGS, Jig, RangedRobot, Ranging
from kilotwin.table.links.robot_link import RobotLink

EXAMPLES = (
    "Examples:\n\n"
    "  kilotwin calibrate ranging --via grid --can socketcan:can0 --size 4x4 --pairs 1-2\n\n"
    "  kilotwin calibrate ranging --via grid --can socketcan:can0 --size 10x20 "
    "--pairs 1-2,3-4 --jig ./stage.sh\n\n"
    "  kilotwin calibrate ranging --via emulated:experiments/calibration/fifty-robots.toml"
)
_EMULATED_CHECKS = "36,46,56,66,76,86,96"
_NEAREST_MM, _FARTHEST_MM = GAIN_DISTANCES_MM[0], 120

Pairs = Annotated[
    str | None,
    typer.Option(
        metavar="UID-UID,...",
        help="The robots that lie in pairs, by uid. Emulated ones pair by themselves.",
    ),
]
JigCommand = Annotated[
    str | None,
    typer.Option(
        "--jig",
        metavar="COMMAND",
        help="Sets the distance in place of a person: called with the millimetres, centre to "
        "centre; exit code 0 when robots lie there.",
    ),
]
Checks = Annotated[
    str | None,
    typer.Option(
        "--check",
        metavar="MM,...",
        help="Then measure at these distances, too, to see how well tables do. Emulated: "
        f"{_EMULATED_CHECKS} if not given.",
    ),
]
ReadingsOption = Annotated[
    int,
    typer.Option(
        "--readings",
        min=2,
        max=100,
        help="Of each robot at each distance.",
    ),
]


def ranging(
    *,
    via: MotorsVia,
    pairs: Pairs = None,
    buses: Buses = None,
    size: Size = None,
    lab: LabFile = Path("lab.toml"),
    jig: JigCommand = None,
    check: Checks = None,
    readings: ReadingsOption = READINGS,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Measure robots' gain tables, for their EEPROM and the lab's file. 4 if some failed.

    Robots lie in pairs on a grid of ours and hear each other at 33, 38 ... 98 mm, centre to centre;
    you are told which distance is next.
    """
    lab_store.lab_of(lab)  # mistakes in it come before the work
    display = steps.display(quiet)
    try:
        if via.startswith(EMULATED):
            checks = parse_checks(_EMULATED_CHECKS if check is None else check)
            if pairs is not None:
                raise InputError(f"--pairs: --via {via} pairs its robots by itself; leave it out")
            result = _emulated(via, lab, checks, readings, display)
        else:
            checks = parse_checks(check or "")
            named = parse_pairs(pairs)
            with link_to_robots(via, buses, size) as link:
                if not link.verifies:
                    raise InputError(
                        f"--via {via}: what robots read does not come back by it; use --via grid"
                    )
                by = _jig(link, jig, via, display, len(GAIN_DISTANCES_MM) + len(checks))
                result = _calibrated(Ranging(named, by, stepwise(display), readings), checks, lab)
    finally:
        display.stop()
    typer.echo(json.dumps(result) if as_json else text(result))
    if result["failed"]:
        raise typer.Exit(EXIT_ROBOTS_FAILED)


def parse_pairs(written: str | None) -> tuple[tuple[int, int], ...]:
    """The pairs that --pairs names, each robot once; InputError otherwise."""
    if not written:
        raise InputError("--pairs: name the robots that lie in pairs, as in --pairs 1-2,3-4")
    pairs = []
    for part in written.split(","):
        uids = part.strip().split("-")
        if len(uids) != 2 or not all(uid.isascii() and uid.isdigit() for uid in uids):
            raise InputError(f"--pairs {written}: '{part}' is no pair; write two uids as in 1-2")
        pairs.append((int(uids[0]), int(uids[1])))
    named = [uid for pair in pairs for uid in pair]
    for uid in named:
        if uid >= LAST_UID:
            raise InputError(
                f"--pairs {written}: uids are 0 to {LAST_UID - 1}; give it one by "
                "kilotwin calibrate uid"
            )
        if named.count(uid) > 1:
            raise InputError(f"--pairs {written}: robot {uid} is in it twice; name it once")
    return tuple(pairs)


def parse_checks(written: str) -> tuple[int, ...]:
    """The distances that --check names, in mm."""
    parts = [part.strip() for part in written.split(",") if part.strip()]
    for part in parts:
        if not part.isascii() or not part.isdigit() or not _NEAREST_MM <= int(part) <= _FARTHEST_MM:
            raise InputError(
                f"--check {written}: '{part}' is no distance; whole mm from {_NEAREST_MM} to "
                f"{_FARTHEST_MM}, as in --check 40,60,80"
            )
    return tuple(map(int, parts))


class _Person:
    """A person at a terminal, who is told the distance and says when robots lie there."""

    def __init__(
        self, link: RobotLink, how: str, display: steps.Lines | steps.Bar, places: int
    ) -> None:
        if not sys.stdin.isatty():
            raise InputError(
                "--jig: this is no terminal; name a command that sets the distance, as in "
                "--jig ./stage.sh"
            )
        self.how = how
        self._link, self._display = link, display
        self._number, self._places = 0, places

    def place(self, mm: int) -> RobotLink:
        """As Jig has it; InterruptError if the person leaves."""
        self._number += 1
        self._display.stop()
        touching = ": they touch" if mm == _NEAREST_MM else ""
        typer.echo(
            f"{self._number} of {self._places}: put the robots of each pair {mm} mm apart, centre "
            f"to centre{touching}; Enter when they lie there, x to leave",
            err=True,
        )
        with keyboard.keys() as keys:
            for key in keys:
                if key == "\n":
                    return self._link
                if key == "x":
                    break
        raise InterruptError("left before the last distance; nothing was saved")


class _Command:
    """A command that moves the robots."""

    def __init__(self, link: RobotLink, command: str, how: str) -> None:
        self.how = how
        self._link, self._command = link, command

    def place(self, mm: int) -> RobotLink:
        """As Jig has it; DeviceError if the command fails."""
        try:
            done = subprocess.run([self._command, str(mm)], check=False)
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise InputError(f"--jig {self._command}: {reason}; name a program") from None
        if done.returncode:
            raise DeviceError(
                f"--jig {self._command} {mm}: exit code {done.returncode}; nothing was saved, see "
                "to the jig, then type this again"
            )
        return self._link


def _jig(
    link: RobotLink, command: str | None, via: str, display: steps.Lines | steps.Bar, places: int
) -> Jig:
    if command is not None:
        return _Command(link, command, f"{via}, jig {command}")
    return _Person(link, via, display, places)


def _emulated(
    via: str, lab: Path, checks: Sequence[int], readings: int, display: steps.Lines | steps.Bar
) -> dict[str, Any]:
    jig = EmulatedJig(Experiment.load(Path(via.removeprefix(EMULATED))))
    try:
        work = Ranging(jig.pairs, jig, stepwise(display), readings)
        result = _calibrated(work, checks, lab)
        result["simulated_s"] = round(jig.simulated_s)
    finally:
        jig.close()
    return result


def _calibrated(work: Ranging, checks: Sequence[int], lab: Path) -> dict[str, Any]:
    work.run(checks)
    robots = list(work.robots.values())
    entries = [
        Entry(
            robot.uid,
            {"low_gain": robot.tables.low, "high_gain": robot.tables.high},
            "ranging",
            f"beside robot {robot.partner}, {work.how}",
        )
        for robot in robots
        if robot.saved and robot.tables is not None
    ]
    if entries:
        lab_store.store(lab, entries, datetime.now())
    result: dict[str, Any] = {
        "lab": str(lab),
        "robots": [_as_dict(robot) for robot in robots],
        "failed": [robot.uid for robot in robots if not robot.saved],
    }
    if checks:
        result["error_mm"] = _errors(robots)
    return result


def _as_dict(robot: RangedRobot) -> dict[str, Any]:
    tables = robot.tables
    reach = reach_mm(robot.readings)
    seen = "saved" if robot.saved else "not saved" if tables else "not heard often enough"
    return {
        "uid": robot.uid,
        "partner": robot.partner,
        "reach_mm": reach,
        "low_gain": None if tables is None else list(tables.low),
        "high_gain": None if tables is None else list(tables.high),
        "result": seen,
    }


def _errors(robots: Sequence[RangedRobot]) -> dict[str, Any]:
    """Errors in mm of the distances estimated from the readings at the checked distances.

    Three sets of tables are compared: those that the robots came with, if they had any; the mean
    table for all; and the measured ones.
    """
    ranged = [(robot, robot.tables) for robot in robots if robot.tables is not None]
    if not ranged:
        return {}
    one = mean_of([tables for _, tables in ranged])
    found = {
        "came_with": [
            errors_mm(robot.came_with, robot.checks) for robot, _ in ranged if robot.came_with
        ],
        "one_table": [errors_mm(one, robot.checks) for robot, _ in ranged],
        "measured": [errors_mm(tables, robot.checks) for robot, tables in ranged],
    }
    quality = {}
    for which, some in found.items():
        off = np.concatenate(some) if some else np.array([])
        if len(off):
            # A robot's own error is what its tables do; single readings scatter besides.
            own = [float(np.mean(of_robot)) for of_robot in some if len(of_robot)]
            quality[which] = {
                "rms": round(float(np.sqrt(np.mean(off**2))), 2),
                "median": round(float(np.median(np.abs(off))), 2),
                "p90": round(float(np.percentile(np.abs(off), 90)), 2),
                "spread_of_robots": round(float(np.std(own)), 2),
            }
    return quality


_WHICH = {
    "came_with": "by the tables that they came with",
    "one_table": "by one table for all",
    "measured": "by the tables that were measured",
}


def text(result: Mapping[str, Any]) -> str:
    """A table for people, and how well tables do."""
    lines = []
    for robot in result["robots"]:
        line = f"robot {robot['uid']:>5} beside {robot['partner']:>5}: {robot['result']}"
        if robot["low_gain"]:
            low, high = robot["low_gain"], robot["high_gain"]
            line += (
                f"; low {low[0]} to {low[-1]}, high {high[0]} to {high[-1]}, measured to "
                f"{robot['reach_mm']} mm"
            )
        lines.append(line)
    for which, off in result.get("error_mm", {}).items():
        lines.append(
            f"distances {_WHICH[which]}: off by {off['rms']} mm (rms), nine in ten by at most "
            f"{off['p90']} mm; robots' means differ by {off['spread_of_robots']} mm"
        )
    if "simulated_s" in result:
        lines.append(f"it took {result['simulated_s']:,} simulated seconds")
    done = len(result["robots"]) - len(result["failed"])
    lines.append(f"{done} of {len(result['robots'])} robots are in {result['lab']}")
    if result["failed"]:
        lines.append(f"failed: {', '.join(map(str, result['failed']))}")
    return "\n".join(lines)
