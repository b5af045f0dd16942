"""`kilotwin flash modules`: the modules of a Kilogrid, over CAN."""

import contextlib
import json
import re
from collections.abc import Iterator, Sequence
from typing import Annotated

import typer

from kilotwin.commands import steps
from kilotwin.commands.flash.file import Display, File, Force, hex_of, is_built
from kilotwin.commands.options import Buses, Define, Include, Json, Quiet, Size, typed_command
from kilotwin.errors import EXIT_ROBOTS_FAILED, InputError
from kilotwin.experiment.spec.grid_layout import Layout, Module
from kilotwin.table.can.buses import BusName, close_all, need_answers, open_all
from kilotwin.table.flash.image import modules_image
from kilotwin.table.flash.modules import Job, ModulesFlasher
from kilotwin.table.flash.modules_table import Inbox, ModulesTable
from kilotwin.table.grid.can_links import CanLinks
from kilotwin.table.grid.clock import WallClock
from kilotwin.table.grid.console import named_grid

EXAMPLES = (
    "Examples:\n\n"
    "  kilotwin flash modules kilogrid_modules/sites --can socketcan:can0 --size 10x5\n\n"
    "  kilotwin flash modules cell.hex --can socketcand:127.0.0.1 --module 3-7,4-7 --json"
)
_MODULE = re.compile(r"(\d{1,2})-(\d{1,2})")

ModuleOption = Annotated[
    list[str] | None,
    typer.Option(
        "--module",
        metavar="COLUMN-ROW",
        help="Only these, as 3-7,4-7, or repeated; else all that answer.",
    ),
]
OldLoader = Annotated[
    bool,
    typer.Option(
        "--old-loader",
        help="Do not ask: their boot loaders are original ones. Else that is found out.",
    ),
]


def modules(
    file: File,
    *,
    buses: Buses = None,
    size: Size = None,
    module: ModuleOption = None,
    old_loader: OldLoader = False,
    include: Include = None,
    define: Define = None,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a program into the modules of a Kilogrid over CAN, and verify each. 4 if some failed.

    What is missing is sent again until each module has all of it; then they start, and are polled.
    The same command again goes on where it was broken off. With --size or --module all of these are
    expected, else those that answer.
    """
    layout, bus_names = named_grid(buses or [], size)
    need_answers(bus_names, "to flash modules take a CAN adapter")
    wanted = parse_modules(module or [], layout)
    display = steps.display(quiet)
    try:
        if not is_built(file, include, define, "module"):
            close_all(open_all(bus_names))  # building takes a while
        path = hex_of(file, include, define, force=force, display=display, api="module")
        job = Job(
            image=modules_image(path),
            name=file.name,
            modules=wanted,
            expect_all=size is not None,
            old_loader=old_loader,
            again=typed_command(),
        )
        with _table(layout, bus_names, display) as table:
            outcome = ModulesFlasher(job, table, display).flash()
    finally:
        display.stop()
    typer.echo(json.dumps(outcome.as_dict()) if as_json else outcome.text())
    if not outcome.well:
        raise typer.Exit(EXIT_ROBOTS_FAILED)


def parse_modules(texts: list[str], layout: Layout) -> list[Module]:
    """Modules with commas between them; InputError if there are no such on the grid."""
    found: list[Module] = []
    for part in (part for text in texts for part in text.split(",")):
        match = _MODULE.fullmatch(part.strip())
        if match is None:
            what = f"--module {part}: not a module"
            raise InputError(f"{what}; write column-row, with commas between several: 3-7,4-7")
        x, y = int(match[1]), int(match[2])
        if x >= layout.columns or y >= layout.rows:
            what = f"--module {part}: the grid has {layout.columns} x {layout.rows} modules"
            raise InputError(f"{what}; columns and rows count from 0, and --size says how many")
        found.append((x, y))
    return list(dict.fromkeys(found))


@contextlib.contextmanager
def _table(
    layout: Layout, bus_names: Sequence[BusName], display: Display
) -> Iterator[ModulesTable]:
    """The grid at the end of these buses, as long as it is needed."""
    buses = open_all(bus_names)
    inbox = Inbox()
    links = CanLinks([bus.bus for bus in buses], inbox, echoes=[bus.echoes for bus in buses])
    names = [bus.name for bus in buses]
    try:
        yield ModulesTable(layout, links, inbox, names, clock=WallClock(), note=display.note)
    finally:
        close_all(buses)
