"""`kilotwin calibrate uid`: another uid for a robot."""

import json
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands import steps
from kilotwin.commands.calibrate.motors import LabFile, usual_duties
from kilotwin.commands.options import Buses, Json, Quiet, Size
from kilotwin.commands.robots_via import RobotsVia, link_to_robots
from kilotwin.errors import EXIT_ROBOTS_FAILED, InputError
from kilotwin.files.headers import ALL_ROBOTS
from kilotwin.table.lab import lab_store
from kilotwin.table.lab.by_hand import heard, save

EXAMPLES = (
    "Example:\n\n  kilotwin calibrate uid 65535 12 --via ohc:/dev/ttyUSB0\n\n"
    "65535 is the uid of a robot that never got one. Have only one such robot in reach."
)
Uid = Annotated[int, typer.Argument(min=0, max=ALL_ROBOTS, help="The robot's present uid.")]
NewUid = Annotated[int, typer.Argument(min=0, max=ALL_ROBOTS - 1, help="The one it gets.")]


def uid(
    uid: Uid,
    new_uid: NewUid,
    *,
    via: RobotsVia,
    buses: Buses = None,
    size: Size = None,
    lab: LabFile = Path("lab.toml"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Give a robot another uid, in its EEPROM and in the lab's file.

    Its runtime has to be ours: an original one would give the uid to every robot in a trial.
    """
    if uid == new_uid:
        raise InputError(f"{new_uid}: that is its uid already; name another one")
    known = lab_store.lab_of(lab)
    duties = lab_store.duties_of(known.robots.get(uid), usual_duties())
    if new_uid in known.robots:
        lab_store.rename(lab, uid, new_uid)  # says where the other robot stands
    display = steps.display(quiet)
    display.step(f"robot {uid} becomes {new_uid}")
    answers: bool | None = None
    try:
        with link_to_robots(via, buses, size) as link:
            save(link, uid, list(duties.values()), new_uid)
            if link.verifies:
                answers = new_uid in heard(link, {new_uid})
    finally:
        display.stop()
    if answers is not False:
        lab_store.rename(lab, uid, new_uid)
    told = {True: "verified", None: "sent, not verifiable", False: "no answer from it"}[answers]
    if as_json:
        now = datetime.now().astimezone().isoformat(timespec="seconds")
        typer.echo(json.dumps({"uid": uid, "new_uid": new_uid, "result": told, "at": now}))
    else:
        typer.echo(f"robot {uid} is {new_uid}: {told}")
    if answers is False:
        raise typer.Exit(EXIT_ROBOTS_FAILED)
