"""`kilotwin record`: an experiment on a Kilogrid, or a virtual environment by camera and light."""

import json
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from kilotwin.commands import terminal
from kilotwin.commands.options import (
    Buses,
    File,
    Json,
    NoBrowser,
    Quiet,
    RunFolder,
    Seed,
    Settings,
    Speed,
    Takeover,
    View,
    ViewPort,
    command_app,
    given_settings,
)
from kilotwin.commands.window import beside, stay, window
from kilotwin.errors import EXIT_INTERRUPTED, InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.session import overhead_recording, recording
from kilotwin.session.run import Outcome
from kilotwin.table.can.buses import name_all
from kilotwin.table.environment.poses import parse_address
from kilotwin.table.links.via import parse_via

if TYPE_CHECKING:
    from kilotwin.session.attached import AttachedViewer

app = command_app()


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin record experiments/kilogrid/paper-n50.toml --can socketcand:127.0.0.1\n\n"
    "  kilotwin record my.toml --can socketcan:can0 --can socketcan:can1 --view\n\n"
    "  kilotwin record experiments/environment/wall.toml --via ohc:/dev/ttyUSB0 "
    "--poses udp:0.0.0.0:5005"
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
            help="Take over a grid that runs already: no set-up, t = 0 is now.",
        ),
    ] = False,
    takeover: Takeover = False,
    force: Annotated[
        bool,
        typer.Option(
            "--force",
            help="Also on a grid some of whose modules do not answer.",
        ),
    ] = False,
    via: Annotated[
        str | None,
        typer.Option(
            metavar="ohc:PORT",
            help="Without a grid: play the \\[environment] by this overhead controller.",
        ),
    ] = None,
    poses: Annotated[
        str | None,
        typer.Option(
            metavar="udp:HOST:PORT",
            help="--via: a tracker's poses come to this address, as lines of JSON.",
        ),
    ] = None,
    speed: Speed = 1.0,
    view: View = False,
    view_port: ViewPort = 0,
    no_browser: NoBrowser = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run an experiment on a table and leave a run folder. Ctrl-C leaves everything idle."""
    loaded = Experiment.load(experiment, given_settings(settings, seed))
    display = terminal.display(quiet, terminal.recorded)
    seen = window(view, display, port=view_port, no_browser=no_browser, quiet=quiet, steers=False)
    if via is not None or poses is not None:
        if buses or join:
            raise InputError("--via: --can and --join are a grid's; leave them out")
        setup = _setup(via, poses, speed)
        with seen as viewer:
            shown = beside(display, viewer)
            played = overhead_recording.record(loaded, setup, out, sys.argv, shown)
            _end(played, terminal.environment_record_text, viewer, as_json=as_json)
    if loaded.keys.environment is not None:
        what = "an [environment] goes by --via ohc:PORT and --poses udp:HOST:PORT; add both"
        raise InputError(f"{experiment}: {what}")
    if loaded.keys.grid is None:
        raise InputError(f"{experiment}: no [grid]; add it, or use `kilotwin run`")
    grid = loaded.keys.grid
    names = name_all(buses or [], grid.buses, (grid.columns, grid.rows))
    with seen as viewer:
        outcome = recording.record(
            loaded,
            names,
            out,
            sys.argv,
            beside(display, viewer),
            join=join,
            takeover=takeover,
            force=force,
            speed=speed,
        )
        told = outcome.summary["grid"]
        bad_modules = terminal.module_troubles_text(told["modules_failed"])
        for troubles in filter(None, (bad_modules, terminal.bus_troubles_text(told))):
            typer.echo(troubles, err=True)
        _end(outcome, terminal.record_text, viewer, as_json=as_json)


def _setup(via: str | None, poses: str | None, speed: float) -> overhead_recording.Setup:
    """The table that --via and --poses name."""
    if via is None:
        raise InputError("--poses needs --via ohc:PORT; add it")
    named = parse_via(via)
    if named.kind != "ohc":
        raise InputError(f"--via {via}: allowed: ohc:PORT; a grid is named by --can")
    if poses is None:
        raise InputError(f"--via {via} needs --poses udp:HOST:PORT; add it")
    return overhead_recording.Setup(named.port, parse_address(poses), speed)


def _end(
    outcome: Outcome,
    text_of: Callable[[dict[str, Any]], str],
    viewer: "AttachedViewer | None",
    *,
    as_json: bool,
) -> NoReturn:
    """Says how it ended; a page stays, unless that was by hand."""
    typer.echo(json.dumps(outcome.summary) if as_json else text_of(outcome.summary))
    if outcome.exit_code == EXIT_INTERRUPTED:
        typer.echo("interrupted; what was recorded is kept", err=True)
    else:
        stay(viewer)
    raise typer.Exit(outcome.exit_code)
