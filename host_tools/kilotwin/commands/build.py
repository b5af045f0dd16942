"""`kilotwin build`: a guest of a robot program, and how large it is."""

import json
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.build.report import build_program, report_text
from kilotwin.commands import terminal
from kilotwin.commands.options import Define, Include, Json, Quiet, Sources, command_app

app = command_app()


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin build my.c\n\n"
    "  kilotwin build main.c helpers.c -I include -D N=3 -o my.so --json"
)
def build(
    program: Sources,
    *,
    include: Include = None,
    define: Define = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", envvar="KILOTWIN_OUTPUT", help="Copy the guest there."),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Build a robot program into a guest and say how large it is."""
    report = build_program(program, include or [], define or [], output, terminal.note(quiet))
    typer.echo(json.dumps(report) if as_json else report_text(report))
