"""`kilotwin calibrate motors`: duties by themselves on a grid, by hand, or as they are named."""

import json
import math
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from kilotwin.commands import keyboard, steps
from kilotwin.commands.flash.robots import Uids, parse_uids
from kilotwin.commands.options import Buses, Json, Quiet, Size
from kilotwin.commands.robots_via import link_to_robots
from kilotwin.errors import EXIT_ROBOTS_FAILED, DeviceError, InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.lab_file import Lab
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.schema.section import LAST_UID
from kilotwin.experiment.spec.overhead import DUTIES
from kilotwin.files.headers import ALL_ROBOTS
from kilotwin.session.emulated_calibration import EmulatedTable, true_bends, true_turns
from kilotwin.table.flash.progress import stepwise
from kilotwin.table.grid.clock import WallClock
from kilotwin.table.grid.console import named_grid
from kilotwin.table.lab import by_hand, lab_store, motor_rounds
from kilotwin.table.lab.lab_store import Entry
from kilotwin.table.lab.motor_rounds import MotorRounds, Robot, Table
from kilotwin.table.links.robot_link import RobotLink, RobotState
from kilotwin.table.links.roll_call import RollCall
from kilotwin.table.links.via import forms

EXAMPLES = (
    "Examples:\n\n"
    "  kilotwin calibrate motors --via grid --can socketcan:can0 --size 10x20\n\n"
    "  kilotwin calibrate motors --via ohc:/dev/ttyUSB0 --uids 12\n\n"
    "  kilotwin calibrate motors --via ohc:/dev/ttyUSB0 --set 12:turn_left=65\n\n"
    "  kilotwin calibrate motors --via emulated:experiments/calibration/fifty-robots.toml"
)
EMULATED = "emulated:"
"""Beginning of --via for an experiment's robots."""
_QUIET_QUESTIONS = 6
_SET = re.compile(r"(\d+):(\w+)=(\d+)")

LabFile = Annotated[Path, typer.Option("--lab", help="The lab's file; made if not there.")]
MotorsVia = Annotated[
    str,
    typer.Option(
        "--via",
        metavar="KIND[:PORT]",
        envvar="KILOTWIN_ROBOTS_VIA",
        help=f"How robots are reached: {forms()}, or emulated:EXPERIMENT for the robots of its "
        "emulated grid. A grid has --can, and --size.",
    ),
]
SetDuties = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="UID:DUTY=VALUE",
        envvar="KILOTWIN_SET_DUTIES",
        help=f"Save this duty, 0 to 255, without a trial: {', '.join(DUTIES)}. Repeatable.",
    ),
]
Rounds = Annotated[
    int,
    typer.Option(min=1, max=20, help="On a grid: how often all drive."),
]
DriveS = Annotated[
    float,
    typer.Option(min=30, max=3600, help="On a grid: for how long in each round."),
]


Turns = Annotated[
    bool,
    typer.Option(
        "--turns/--no-turns",
        help="On a grid: whether duties of turns are set, too. Without, they stay.",
    ),
]


def usual_duties() -> dict[str, int]:
    """Those of a robot that was never measured."""
    return {key: getattr(PROFILES["kilobot"], key) for key in DUTIES}


def motors(
    *,
    via: MotorsVia,
    buses: Buses = None,
    size: Size = None,
    uids: Uids = None,
    lab: LabFile = Path("lab.toml"),
    set_duties: SetDuties = None,
    rounds: Rounds = motor_rounds.ROUNDS,
    drive_s: DriveS = motor_rounds.DRIVE_S,
    turns: Turns = True,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Set the duties of robots' motors, in their EEPROM and in the lab's file. 4 if some failed.

    On a grid of ours all robots are calibrated at once, until they go straight and turn alike.
    Elsewhere it is one robot by hand, by keys, or what --set says.
    """
    known = lab_store.lab_of(lab)
    expected = parse_uids(uids) if uids is not None else frozenset[int]()
    display = steps.display(quiet)
    try:
        if via.startswith(EMULATED):
            file = Path(via.removeprefix(EMULATED))
            result = _emulated(file, lab, (rounds, drive_s, turns), display)
        else:
            wanted = parse_sets(set_duties or [], known)
            with link_to_robots(via, buses, size) as link:
                if wanted:
                    result = _set(link, lab, wanted, via)
                elif link.verifies:
                    layout, _ = named_grid(buses or (), size)
                    table = Table(layout.columns, layout.rows)
                    duties = _duties(expected or _all(link, display), known)
                    work = MotorRounds(link, WallClock(), table, duties, stepwise(display))
                    work.run(rounds, drive_s, turns=turns)
                    result = _of_grid(work, lab, via)
                else:
                    result = _guided(link, lab, known, expected, via)
    finally:
        display.stop()
    typer.echo(json.dumps(result) if as_json else text(result))
    if result["failed"]:
        raise typer.Exit(EXIT_ROBOTS_FAILED)


def parse_sets(texts: Sequence[str], known: Lab) -> dict[int, dict[str, int]]:
    """All four duties of each robot that --set names; those that it leaves out are the lab's."""
    wanted: dict[int, dict[str, int]] = {}
    for written in texts:
        found = _SET.fullmatch(written)
        if not found or found[2] not in DUTIES:
            raise InputError(
                f"--set {written}: not of the form 12:turn_left=65; duties are {', '.join(DUTIES)}"
            )
        uid, duty = int(found[1]), int(found[3])
        if uid > LAST_UID or duty > 255:
            raise InputError(f"--set {written}: uids are 0 to {LAST_UID}, duties 0 to 255")
        usual = lab_store.duties_of(known.robots.get(uid), usual_duties())
        wanted.setdefault(uid, usual)[found[2]] = duty
    return wanted


def _all(link: RobotLink, display: steps.Lines | steps.Bar) -> Iterable[int]:
    """The robots that answer and have a uid of their own."""
    display.step("asking which robots are there")
    roll = RollCall(link)
    roll.ask_until(_QUIET_QUESTIONS)
    found = roll.robots.keys() - {ALL_ROBOTS}
    if not found:
        raise DeviceError(
            "no robot answers; robots need Kilotwin's runtime, and modules Kilotwin's firmware: "
            "`kilotwin robots voltage` shows which answer"
        )
    return found


def _duties(uids: Iterable[int], known: Lab) -> dict[int, list[int]]:
    """The four duties with which each robot comes, as far as the lab knows."""
    return {
        uid: list(lab_store.duties_of(known.robots.get(uid), usual_duties()).values())
        for uid in sorted(uids)
    }


def _set(
    link: RobotLink, lab: Path, wanted: Mapping[int, Mapping[str, int]], via: str
) -> dict[str, Any]:
    for uid, duties in wanted.items():
        by_hand.save(link, uid, list(duties.values()))
    answers = by_hand.heard(link, wanted) if link.verifies else {}
    saved = {
        uid
        for uid in wanted
        if not link.verifies or (uid in answers and answers[uid].robot_state == RobotState.IDLE)
    }
    entries = [Entry(uid, wanted[uid], "motors", f"as named, {via}") for uid in sorted(saved)]
    if entries:
        lab_store.store(lab, entries, datetime.now())
    told = "saved" if link.verifies else "sent, not verifiable"
    robots = [
        {"uid": uid, **duties, "result": told if uid in saved else "not saved"}
        for uid, duties in wanted.items()
    ]
    return {"lab": str(lab), "robots": robots, "failed": sorted(set(wanted) - saved)}


def _of_grid(work: MotorRounds, lab: Path, via: str) -> dict[str, Any]:
    robots = list(work.robots.values())
    how = f"by itself, {via}"
    entries = [Entry(robot.uid, _measured(robot), "motors", how) for robot in robots if robot.saved]
    if entries:
        lab_store.store(lab, entries, datetime.now())
    return {
        "lab": str(lab),
        "robots": [_as_dict(robot) for robot in robots],
        "failed": [robot.uid for robot in robots if not robot.saved],
    }


def _measured(robot: Robot) -> dict[str, int]:
    """The duties that were set; those of turns only if they were."""
    duties = dict(zip(DUTIES, (*robot.turns, *robot.straight), strict=True))
    return duties if robot.turns != robot.turns_before else {key: duties[key] for key in DUTIES[2:]}


def _as_dict(robot: Robot) -> dict[str, Any]:
    before = robot.wheels.turn_rad_s(robot.before) / robot.wheels.speed_m_s(robot.before)
    seen = "saved" if robot.saved else "not saved" if robot.measured else "not seen often enough"
    return {
        "uid": robot.uid,
        **dict(zip(DUTIES, (*robot.turns, *robot.straight), strict=True)),
        "rounds": robot.measured,
        "bend_before_deg_m": round(math.degrees(before)),
        "bend_sd_deg_m": round(math.degrees(robot.bend_sd())),
        "turn_before_share": [
            round(share, 2) for share in robot.wheels.turn_shares(robot.turns_before)
        ],
        "result": seen,
    }


def _emulated(
    file: Path, lab: Path, how: tuple[int, float, bool], display: steps.Lines | steps.Bar
) -> dict[str, Any]:
    """With what the robots truly do, before and after: each alone on a wide floor."""
    experiment = Experiment.load(file)
    uids = [experiment.uid_of(index) for index in range(experiment.size)]
    known = Lab("", dict(experiment.lab))
    emulated = EmulatedTable(experiment)
    try:
        work = MotorRounds(
            emulated.link, emulated.clock, emulated.table, _duties(uids, known), stepwise(display)
        )
        rounds, drive_s, turns = how
        work.run(rounds, drive_s, turns=turns)
        took_s = emulated.clock.now_s()
    finally:
        emulated.close()
    display.step("measuring what robots truly do")
    result = _of_grid(work, lab, f"{EMULATED}{file}")
    before = _duties(uids, known)
    after = {
        uid: (*robot.turns, *robot.straight)
        if robot.saved
        else (*robot.turns_before, *robot.before)
        for uid, robot in work.robots.items()
    }
    result["true_bend_deg_m"] = {
        when: _bend(np.abs(true_bends(experiment, duties)))
        for when, duties in (("before", before), ("after", after))
    }
    if turns:
        result["true_turn_deg_s"] = {
            when: _turning(true_turns(experiment, duties))
            for when, duties in (("before", before), ("after", after))
        }
    result["simulated_s"] = round(took_s)
    return result


def _bend(deg_m: NDArray[np.float64]) -> dict[str, float]:
    return {"median": float(np.median(deg_m)), "p90": float(np.percentile(deg_m, 90))}


def _turning(deg_s: NDArray[np.float64]) -> dict[str, float]:
    """Figures of both directions together; `uneven`: how much a robot's left and right differ."""
    uneven = np.abs(np.log(deg_s[0] / deg_s[1]))
    return {
        "mean": float(deg_s.mean()),
        "sd": float(deg_s.std()),
        "uneven_median": float(np.median(uneven)),
        "uneven_p90": float(np.percentile(uneven, 90)),
    }


def _guided(
    link: RobotLink, lab: Path, known: Lab, expected: frozenset[int], via: str
) -> dict[str, Any]:
    """One robot by keys."""
    if len(expected) != 1:
        raise InputError("--uids: by hand it is one robot at a time; name it, as in --uids 12")
    if not sys.stdin.isatty():
        raise InputError("--set: this is no terminal; say what to save, as in 12:turn_left=65")
    (uid,) = expected
    first = _duties(expected, known)[uid]
    dialog = by_hand.ByHand(link, uid, (first[0], first[1], first[2], first[3]))
    typer.echo(by_hand.HELP, err=True)
    saved: dict[str, int] | None = None
    with keyboard.keys() as keys:
        while not dialog.over:
            typer.echo(f"\r{dialog.line()}\x1b[K", err=True, nl=False)
            dialog.press(next(keys, "x"))
            if dialog.saved and dialog.duties != saved:
                saved = dialog.duties
                lab_store.store(
                    lab, [Entry(uid, saved, "motors", f"by hand, {via}")], datetime.now()
                )
    typer.echo("", err=True)
    told = "not saved" if saved is None else "saved, not verifiable"
    robot = {"uid": uid, **(saved or dialog.duties), "result": told}
    return {"lab": str(lab), "robots": [robot], "failed": [] if saved else [uid]}


def text(result: Mapping[str, Any]) -> str:
    """A table for people, and what emulated robots truly do."""
    lines = []
    for robot in result["robots"]:
        duties = " ".join(f"{robot[key]:>4}" for key in DUTIES)
        bend = ""
        if "rounds" in robot:
            bend = (
                f"  bent {robot['bend_before_deg_m']:>5} deg/m, known "
                f"to +- {robot['bend_sd_deg_m']:>3}"
            )
        lines.append(f"robot {robot['uid']:>5}: {duties}{bend}  {robot['result']}")
    if "true_bend_deg_m" in result:
        for when, of in result["true_bend_deg_m"].items():
            what = f"true bend {when}: median {of['median']:.0f} deg/m, nine in ten below"
            lines.append(f"{what} {of['p90']:.0f}")
        for when, of in result.get("true_turn_deg_s", {}).items():
            lines.append(
                f"true turns {when}: {of['mean']:.1f} +- {of['sd']:.1f} deg/s; left and right of a "
                f"robot differ by {of['uneven_median']:.0%} (median), nine in ten below "
                f"{of['uneven_p90']:.0%}"
            )
        lines.append(f"it took {result['simulated_s']:,} simulated seconds")
    done = len(result["robots"]) - len(result["failed"])
    lines.append(f"{done} of {len(result['robots'])} robots are in {result['lab']}")
    if result["failed"]:
        lines.append(f"failed: {', '.join(map(str, result['failed']))}")
    return "\n".join(lines)
