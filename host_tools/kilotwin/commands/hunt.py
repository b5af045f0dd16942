"""`kilotwin hunt`: what breaks an experiment."""

import json
import time
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands import terminal
from kilotwin.commands.options import (
    ConfineMode,
    Json,
    Quiet,
    Settings,
    Trust,
    command_app,
    given_settings,
)
from kilotwin.commands.sweep import NumberOfProcesses
from kilotwin.commands.test import cores
from kilotwin.errors import InterruptError
from kilotwin.files import confinement
from kilotwin.files.plain_text import plain
from kilotwin.studies.pool.places import Processes

app = command_app()

_MINUTES = 10.0
_MOST_FOUND = 1000


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin hunt my.toml\n\n"
    "  kilotwin hunt my.toml --time 60\n\n"
    "  kilotwin hunt my.toml --trials 2000 --seed 7 --out runs/long-hunt\n\n"
    "  kilotwin hunt my.toml --set hunt.failing=0 --first\n\n"
    "Exit codes: 0 nothing broke it, 1 something did, 2 bad input."
)
def hunt(
    file: Annotated[Path, typer.Argument(metavar="EXPERIMENT", help="The experiment.")],
    *,
    time_s: Annotated[
        float | None,
        typer.Option(
            "--time",
            metavar="SECONDS",
            min=1,
            envvar="KILOTWIN_HUNT_TIME",
            help="Begin no trials after this wall time; 600 if neither it nor --trials is given.",
        ),
    ] = None,
    trials: Annotated[
        int | None,
        typer.Option(min=1, max=10**9, help="End after so many trials, shrinking not counted."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of what is tried.")] = 1,
    first: Annotated[
        bool, typer.Option("--first", help="End with the first thing that breaks it.")
    ] = False,
    processes: NumberOfProcesses = None,
    settings: Settings = None,
    out: Annotated[
        Path | None,
        typer.Option(help="The folder of the hunt; runs/hunt-NAME if not given."),
    ] = None,
    trial_timeout: Annotated[
        float,
        typer.Option(min=0.1, max=1e6, metavar="SECONDS", help="Wall time that a trial may take."),
    ] = 60.0,
    confine: ConfineMode = None,
    trust: Trust = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Search for what breaks an experiment, and shrink it to a scenario that fails.

    Exits 1 if something does. The same command goes on where it was stopped.
    """
    confinement.choose(confine, trust)
    display = terminal.sweep_display(quiet)
    from kilotwin.studies.hunt import report
    from kilotwin.studies.hunt.hunt import prepared
    from kilotwin.studies.hunt.search import Budget

    given = given_settings(settings, None)
    search = prepared(file, given, out, seed, timeout_s=trial_timeout, note=display.note)
    if time_s is None and trials is None:
        time_s = 60 * _MINUTES
    ends_at = None if time_s is None else time.monotonic() + time_s
    budget = Budget(trials, ends_at)
    most = 1 if first else _MOST_FOUND
    try:
        report.hunted(search, Processes(processes or cores()), budget, display, most)
    except KeyboardInterrupt:
        typer.echo(plain(report.text(search, file)))
        what = f"interrupted; the same command goes on from here ({search.folder})"
        raise InterruptError(what) from None
    if as_json:
        typer.echo(json.dumps(report.as_dict(search)))
    else:
        typer.echo(plain(report.text(search, file)))
    raise typer.Exit(1 if search.state.found else 0)
