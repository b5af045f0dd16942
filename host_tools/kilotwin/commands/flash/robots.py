"""`kilotwin flash robots`: a whole swarm, over the air."""

import json
import re
from typing import Annotated

import typer

from kilotwin.commands import steps
from kilotwin.commands.flash.file import File, Force, hex_of, is_built
from kilotwin.commands.options import Buses, Define, Include, Json, Quiet, Size, typed_command
from kilotwin.commands.robots_via import RobotsVia, link_to_robots
from kilotwin.errors import EXIT_ROBOTS_FAILED, InputError
from kilotwin.files.headers import ALL_ROBOTS
from kilotwin.table.flash import over_the_air
from kilotwin.table.flash.image import swarm_image
from kilotwin.table.flash.upload import Upload, Wish
from kilotwin.table.grid.clock import WallClock
from kilotwin.table.links.via import check_there, parse_via

EXAMPLES = (
    "Examples:\n\n"
    "  kilotwin flash robots my.c --via grid --can socketcan:can0 --size 10x5 --count 50 --run\n\n"
    "  kilotwin flash robots my.hex --via grid --can socketcand:127.0.0.1 --uids 1-20,25 --json"
)
_RANGE = re.compile(r"(\d+)(?:-(\d+))?")

Uids = Annotated[
    str | None,
    typer.Option(
        "--uids",
        metavar="1-50,60",
        help="Which robots are expected; else those that answer at first.",
    ),
]
CountOption = Annotated[
    int | None,
    typer.Option("--count", min=1, max=10000, help="How many robots are expected."),
]
Laps = Annotated[
    int,
    typer.Option(
        "--laps",
        min=1,
        max=100,
        help="How often all is sent everywhere for robots that do not answer.",
    ),
]
Run = Annotated[bool, typer.Option("--run", help="Then have the program run.")]


def robots(
    file: File,
    *,
    via: RobotsVia,
    buses: Buses = None,
    size: Size = None,
    uids: Uids = None,
    count: CountOption = None,
    laps: Laps = 3,
    run: Run = False,
    include: Include = None,
    define: Define = None,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a program into all robots by infrared light, and verify each. 4 if some failed.

    What is missing is sent again until every robot that is expected has all of it; then they start
    together. The same command again goes on where it was broken off.
    """
    if uids is not None and count is not None:
        raise InputError("--count: --uids says already how many; leave one of them out")
    expected = parse_uids(uids) if uids is not None else frozenset[int]()
    named = parse_via(via, buses or (), size)
    display = steps.display(quiet)
    try:
        if not is_built(file, include, define):
            check_there(named)  # building and its checks take half a minute
        path = hex_of(file, include, define, force=force, display=display)
        wish = Wish(swarm_image(path), expected, count, laps, run)
        with link_to_robots(via, buses, size) as link:
            upload = Upload(wish, link.verifies, link.laps_per_place)
            display.note(_what(wish))
            over_the_air.SwarmFlasher(upload, link, WallClock(), display, typed_command()).run()
    finally:
        display.stop()
    typer.echo(json.dumps(over_the_air.as_dict(upload)) if as_json else over_the_air.text(upload))
    if not upload.well:
        raise typer.Exit(EXIT_ROBOTS_FAILED)


def parse_uids(text: str) -> frozenset[int]:
    """Numbers and ranges with commas between them; InputError if it is anything else."""
    uids = set[int]()
    for part in text.split(","):
        found = _RANGE.fullmatch(part.strip())
        first = int(found[1]) if found else -1
        last = int(found[2] or found[1]) if found else -1
        if not 0 <= first <= last < ALL_ROBOTS:
            raise InputError(f"--uids {text}: not numbers up to 65534 or ranges, as in 1-50,60")
        uids.update(range(first, last + 1))
    return frozenset(uids)


def _what(wish: Wish) -> str:
    image = wish.image
    made_of = image.build_id or "no build id"
    return f"{len(image.pages)} pages, image {image.image_id:08X}, {made_of}"
