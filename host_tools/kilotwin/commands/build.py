"""`kilotwin build`: an image to flash of a program, or a guest, and how large it is."""

import json
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands import steps
from kilotwin.commands.options import Define, Include, Json, Quiet, command_app
from kilotwin.errors import InputError
from kilotwin.experiment.programs import Api, Printf, ProgramError, find_program
from kilotwin.programs.image.flash_report import build_hex, built_text, show_hex, shown_text
from kilotwin.programs.report import build_program, report_text

app = command_app()


class For(StrEnum):
    """Targets of a build."""

    robot = "robot"
    module = "module"


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin build my.c --hex my.hex\n\n"
    "  kilotwin build lab/ -I include -D N=3 --hex lab.hex --json\n\n"
    "  kilotwin build cell.c --for module --hex cell.hex\n\n"
    "  kilotwin build --show my.hex\n\n"
    "  kilotwin build main.c helpers.c -o my.so"
)
def build(
    program: Annotated[
        list[str] | None,
        typer.Argument(help="A .c file or several, or a folder whose .c files are one."),
    ] = None,
    *,
    target: Annotated[For, typer.Option("--for", help="What the program runs on.")] = For.robot,
    hex_file: Annotated[
        Path | None,
        typer.Option(
            "--hex",
            metavar="FILE.hex",
            help="Build the image to flash, with FILE.elf beside it.",
        ),
    ] = None,
    printf: Annotated[
        Printf, typer.Option(help="With floats an image prints %f, in 1.5 KB more flash.")
    ] = "integers",
    include: Include = None,
    define: Define = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Without --hex: copy the guest there."),
    ] = None,
    show: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.hex",
            help="Build nothing: say what a .hex file holds, and what it was built of.",
        ),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Build a program into an image to flash, or a guest, and say how large it is.

    With --hex it is built for the ATmega328P of a robot or a Kilogrid module, without for this PC.
    """
    if (show is None) != bool(program):
        raise InputError("build takes a program, or --show and a .hex file; name one of them")
    if output is not None and (show or hex_file):
        raise InputError(f"-o {output}: names the file of a guest; leave it out here")
    if show is not None:
        report, text = show_hex(show), shown_text
    else:
        try:
            api: Api | None = "module" if target is For.module else None
            found = find_program(program or [], Path.cwd(), include or [], define or [], api)
        except ProgramError as error:
            raise InputError(str(error)) from None
        found = replace(found, printf=printf)
        if hex_file is not None:
            report, text = build_hex(found, hex_file, steps.note(quiet)), built_text
        else:
            report, text = build_program(found, output, steps.note(quiet)), report_text
    typer.echo(json.dumps(report) if as_json else text(report))
