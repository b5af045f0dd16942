"""`kilotwin port`: what of a program would go wrong on the robot."""

import json
from typing import Annotated

import typer

from kilotwin.commands import steps
from kilotwin.commands.options import Define, Include, Json, Quiet, Sources, command_app
from kilotwin.programs.port.check import check
from kilotwin.programs.port.trial import Trial

app = command_app()


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin port my.c\n\n"
    "  kilotwin port my.c --time 600 --seed 7\n\n"
    "  kilotwin port main.c helpers.c -I include -D N=3 --json"
)
def port(
    program: Sources,
    *,
    include: Include = None,
    define: Define = None,
    seconds: Annotated[
        float,
        typer.Option(
            "--time",
            min=1,
            max=86400,
            help="Simulated seconds to run it for.",
        ),
    ] = 60,
    seed: Annotated[int, typer.Option(min=0, help="Of what it hears and draws.")] = 1,
    no_run: Annotated[bool, typer.Option("--no-run", help="Look at the code only.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say what of a program would go wrong on the robot. 1 if something fails there.

    It is looked at, and run on an emulated ATmega328P and on this computer with the same messages,
    light and random numbers.
    """
    trial = None if no_run else Trial(seconds, seed)
    report = check(program, include or [], define or [], trial, steps.note(quiet))
    typer.echo(json.dumps(report.as_dict()) if as_json else report.text())
    if report.fails:
        raise typer.Exit(1)
