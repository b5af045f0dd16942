"""`kilotwin record`: an experiment on a Kilogrid, real or emulated on a bus."""

import json
import sys
from typing import Annotated

import typer

from kilotwin.can.buses import name_all
from kilotwin.commands import terminal
from kilotwin.commands.options import (
    Buses,
    File,
    Json,
    Quiet,
    RunFolder,
    Seed,
    Settings,
    Speed,
    command_app,
    given_settings,
)
from kilotwin.errors import EXIT_INTERRUPTED, InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.runs import recording

app = command_app()


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin record experiments/kilogrid/paper-n50.toml --can socketcand:127.0.0.1\n\n"
    "  kilotwin record my.toml --can socketcan:can0 --can socketcan:can1"
)
def record(
    experiment: File,
    *,
    buses: Buses = None,
    seed: Seed = None,
    settings: Settings = None,
    out: RunFolder = None,
    join: Annotated[
        bool,
        typer.Option(
            "--join",
            envvar="KILOTWIN_JOIN",
            help="Take over a grid that runs already: no set-up, t = 0 is now.",
        ),
    ] = False,
    speed: Speed = 1.0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run an experiment on a Kilogrid and leave a run folder. Ctrl-C leaves everything idle."""
    loaded = Experiment.load(experiment, given_settings(settings, seed))
    if loaded.keys.grid is None:
        raise InputError(f"{experiment}: no [grid]; add it, or use `kilotwin run`")
    grid = loaded.keys.grid
    names = name_all(buses or [], grid.buses, (grid.columns, grid.rows))
    outcome = recording.record(
        loaded, names, out, sys.argv, terminal.display(quiet), join=join, speed=speed
    )
    typer.echo(json.dumps(outcome.summary) if as_json else terminal.record_text(outcome.summary))
    told = outcome.summary["grid"]
    bad_modules = terminal.module_troubles_text(told["modules_failed"])
    for troubles in filter(None, (bad_modules, terminal.bus_troubles_text(told))):
        typer.echo(troubles, err=True)
    if outcome.exit_code == EXIT_INTERRUPTED:
        typer.echo("interrupted; what was recorded is kept", err=True)
    raise typer.Exit(outcome.exit_code)
