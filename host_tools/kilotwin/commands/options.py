"""Options that several commands have: each is declared once, and means the same everywhere."""

import math
import sys
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.experiment.text import Setting, parse_setting
from kilotwin.files.confinement import Confine
from kilotwin.session.pace import LEAST_SPEED, MOST_SPEED

SEE = "See it"
"""Headings of options in a command's help; what has none stands below "Options"."""
INSIDE = "Look inside programs"
TRUST = "Trust"
PRINT = "Print"

Json = Annotated[
    bool,
    typer.Option("--json", rich_help_panel=PRINT, help="Print JSON on stdout, for programs."),
]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", rich_help_panel=PRINT, help="No progress on stderr.")
]
File = Annotated[Path, typer.Argument(help="The experiment's TOML file.")]
Seed = Annotated[int | None, typer.Option(help="In place of the file's seed.")]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set any key of the file; repeatable.",
    ),
]
Where = Annotated[
    list[str] | None,
    typer.Option(
        metavar="COLUMN=VALUE",
        help="Of a sweep, only trials that have this in trials.parquet, or none; repeatable.",
    ),
]
RunFolder = Annotated[
    Path | None,
    typer.Option(help="The run folder to make; runs/NAME-seedN-TIME if not given."),
]
Speed = Annotated[
    float,
    typer.Option(
        min=0.01,
        max=1000,
        help="Simulated seconds per second, of an emulated table and its host alike.",
    ),
]
Sources = Annotated[
    list[str], typer.Argument(help="A .c file or several, or a folder whose .c files are one.")
]
Include = Annotated[
    list[str] | None,
    typer.Option(
        "-I", metavar="DIR", envvar="KILOTWIN_INCLUDE", help="Look for headers in DIR too."
    ),
]
Define = Annotated[
    list[str] | None,
    typer.Option(
        "-D",
        metavar="NAME[=VALUE]",
        envvar="KILOTWIN_DEFINE",
        help="Define a macro, as the compiler's -D.",
    ),
]
Takeover = Annotated[
    bool,
    typer.Option(
        "--takeover",
        help="Give orders to a table though another host does; what that one records is spoiled.",
    ),
]
ConfineMode = Annotated[
    Confine | None,
    typer.Option(
        "--confine",
        rich_help_panel=TRUST,
        help="Confine robots' programs and their compiler as far as this kernel can (auto), wholly "
        "or not at all (require), or not (off).",
    ),
]
Trust = Annotated[
    bool,
    typer.Option(
        "--trust", rich_help_panel=TRUST, help="The programs are trusted: as --confine=off."
    ),
]
NoTwin = Annotated[
    bool,
    typer.Option(
        "--no-twin", rich_help_panel=INSIDE, help="Hold no program against its ATmega328P."
    ),
]
RequireTwin = Annotated[
    bool,
    typer.Option(
        "--require-twin",
        rich_help_panel=INSIDE,
        help="First hold each native program against its ATmega328P for 10 s of one robot, and run "
        "nothing if it decides otherwise there, or if there is no avr-gcc.",
    ),
]
Buses = Annotated[
    list[str] | None,
    typer.Option("--can", metavar="IFACE:CHANNEL", help="A CAN bus; repeatable."),
]

PAGE_SPEED = 10.0
"""Times real time that a run goes beside its page, if nothing else is asked for."""


def _times_real_time(text: str) -> float:
    """10 of "10", infinity of "max"."""
    if text == "max":
        return math.inf
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not LEAST_SPEED <= speed <= MOST_SPEED:
        raise typer.BadParameter(
            f"'{text}': give simulated seconds per second, {LEAST_SPEED:g} to {MOST_SPEED:g} "
            "(1 is real time), or max"
        )
    return speed


ViewSpeed = Annotated[
    float | None,
    typer.Option(
        "--speed",
        metavar="TIMES",
        rich_help_panel=SEE,
        parser=_times_real_time,
        help=f"--view: how many times real time it goes, {PAGE_SPEED:g} if not given, from when "
        "the page is open; max: as fast as it can, waiting for no page.",
    ),
]
View = Annotated[
    bool,
    typer.Option(
        "--view",
        rich_help_panel=SEE,
        help="Also show it in the browser as it goes; the page stays until it is closed.",
    ),
]
ViewPort = Annotated[
    int,
    typer.Option(
        min=0,
        max=65535,
        metavar="PORT",
        rich_help_panel=SEE,
        help="--view: the server's port; 0: a free one.",
    ),
]
NoBrowser = Annotated[
    bool,
    typer.Option(
        "--no-browser",
        rich_help_panel=SEE,
        help="Open no browser: only print the address of the viewer's page.",
    ),
]

Size = Annotated[
    str | None,
    typer.Option(
        "--size",
        metavar="COLUMNSxROWS",
        help="Of the grid in modules, if no experiment says it; 10x20 if not given.",
    ),
]


def command_app() -> typer.Typer:
    """Holder of the one command of a module; `cli.load` takes it from there."""
    return typer.Typer(
        add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich"
    )


def typed_command() -> list[str]:
    """The words that were typed, to be named again when something breaks off."""
    return ["kilotwin", *sys.argv[1:]]


def given_settings(settings: list[str] | None, seed: int | None) -> list[Setting]:
    """The settings of --set and --seed, in this order: the last one wins."""
    given = [parse_setting(text) for text in settings or []]
    if seed is not None:
        given.append(Setting(("seed",), seed, f"--seed {seed}"))
    return given
