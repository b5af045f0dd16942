"""The FILE of `kilotwin flash`: a .hex, or a program that is built first if it would run."""

from pathlib import Path
from typing import Annotated

import typer

from kilotwin.build.avr import build_image
from kilotwin.commands import lazy, steps
from kilotwin.errors import InputError, RunError
from kilotwin.experiment.programs import ProgramError, find_program
from kilotwin.files.flash_image import HEX_SUFFIXES

File = Annotated[
    Path, typer.Argument(metavar="FILE", help="A .hex; or a .c or a folder, to be built first.")
]
Force = Annotated[
    bool,
    typer.Option(
        "--force", envvar="KILOTWIN_FORCE", help="Also what `kilotwin port` says would fail."
    ),
]
Display = steps.Lines | steps.Bar


def is_built(file: Path, include: list[str] | None, define: list[str] | None) -> bool:
    """Whether it is a .hex; InputError if options for building go with it."""
    built = file.suffix.lower() in HEX_SUFFIXES
    if built and (include or define):
        raise InputError(f"{file} is built already; -I and -D are for a .c or a folder")
    return built


def build(
    file: Path,
    include: list[str] | None,
    define: list[str] | None,
    *,
    force: bool,
    display: Display,
) -> Path:
    """The .hex of a program, if `kilotwin port` finds nothing that fails on the robot."""
    include, define = include or [], define or []
    if not force:
        trial = lazy.load("port.trial").Trial()
        report = lazy.load("port.check").check([str(file)], include, define, trial, display.step)
        if report.fails:
            raise RunError(
                f"{file} would fail on the robot; mend it, or type --force. Nothing was written",
                detail=report.text(),
            )
    try:
        program = find_program([str(file)], Path.cwd(), include, define)
    except ProgramError as error:
        raise InputError(f"{error}, or a .hex") from None
    return build_image(program, display.step).hex
