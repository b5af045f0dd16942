"""`kilotwin grid ...`: orders for the modules of a Kilogrid, real or emulated on a bus."""

import json
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands import steps
from kilotwin.commands.options import Buses, Json, Quiet, Settings, Size, Takeover, given_settings
from kilotwin.errors import EXIT_ROBOTS_FAILED, InputError, RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec import kconf
from kilotwin.table.grid.console import Console, message_for_robots
from kilotwin.table.links import preflight, readiness

app = typer.Typer(
    help="Talks to the modules of a Kilogrid, and through them to its robots.",
    epilog="A bus is IFACE:CHANNEL, with any interface that python-can knows: socketcan:can0, "
    "slcan:/dev/ttyACM0, or socketcand:127.0.0.1 for all buses of an emulated grid: four, if no "
    "experiment says how many. Give --can once per bus, the lowest rows first.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


@app.command(epilog="Example: kilotwin grid ls --can socketcand:127.0.0.1")
def ls(
    buses: Buses = None, size: Size = None, takeover: Takeover = False, as_json: Json = False
) -> None:
    """Say which modules answer. 4 if some do not."""
    with _console(buses, size, takeover) as console:
        silent = console.look()
        typer.echo(json.dumps(console.presence()) if as_json else console.presence_text())
    if silent:
        raise typer.Exit(EXIT_ROBOTS_FAILED)


@app.command(epilog="Example: kilotwin grid health --can can0 --json")
def health(
    buses: Buses = None, size: Size = None, takeover: Takeover = False, as_json: Json = False
) -> None:
    """Ask modules how they are. Original ones do not know the question; ours answer."""
    with _console(buses, size, takeover) as console:
        console.look()
        answers = console.health()
        typer.echo(json.dumps(answers) if as_json else console.health_text())
        silent = console.silent
    if silent:
        raise typer.Exit(EXIT_ROBOTS_FAILED)


@app.command(
    epilog="Example: kilotwin grid check experiments/kilogrid/paper-n50.toml --can "
    "socketcand:127.0.0.1"
)
def check(
    experiment: Annotated[Path, typer.Argument(help="An experiment with a \\[grid].")],
    *,
    buses: Buses = None,
    takeover: Takeover = False,
    settings: Settings = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Hold buses, modules and robots against an experiment, in one table. 1 if it is not ready.

    Nothing is changed. Of robots those are told that are awake and have Kilotwin's runtime.
    """
    loaded = Experiment.load(experiment, given_settings(settings, None))
    found = preflight.check(loaded, buses or [], takeover=takeover, note=steps.note(quiet))
    typer.echo(json.dumps(readiness.as_dict(found)) if as_json else readiness.text(found))
    if not readiness.is_ready(found):
        raise typer.Exit(RunError.exit_code)


@app.command(
    "kconf", epilog="Example: kilotwin grid kconf experiments/kilogrid/paper-n50.toml > n50.kconf"
)
def write_kconf(
    experiment: Annotated[Path, typer.Argument(help="An experiment with a \\[grid].")],
    *,
    settings: Settings = None,
) -> None:
    """Print the .kconf file that configures modules as an experiment does."""
    loaded = Experiment.load(experiment, given_settings(settings, None))
    if loaded.plan is None:
        raise InputError(f"{experiment}: there is no [grid]; add one with columns and rows")
    configuration = loaded.plan.configuration
    if not configuration:
        what = "modules with a program of yours have no configuration; set grid.configuration"
        raise InputError(f"{experiment}: {what}")
    typer.echo(kconf.to_text(kconf.blocks_of(configuration)), nl=False)


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin grid setup experiments/kilogrid/paper-n50.toml --can socketcand:127.0.0.1\n\n"
    "  kilotwin grid setup walls.kconf --can socketcan:can0 --size 10x5"
)
def setup(
    file: Annotated[Path, typer.Argument(help="An experiment, or a .kconf file.")],
    *,
    buses: Buses = None,
    size: Size = None,
    takeover: Takeover = False,
    settings: Settings = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Configure the modules; with an experiment the robots too, who start anew."""
    note = steps.note(quiet)
    if file.suffix == ".kconf":
        with _console(buses, size, takeover) as console:
            done = console.configure(file, note)
    else:
        loaded = Experiment.load(file, given_settings(settings, None))
        with _console(buses, size, takeover, loaded) as console:
            done = console.set_up(loaded, note)
    typer.echo(json.dumps(done) if as_json else f"{done['modules']} modules are set up")
    if done["silent"]:
        typer.echo(f"{len(done['silent'])} modules do not answer: {done['silent']}", err=True)
        raise typer.Exit(EXIT_ROBOTS_FAILED)


@app.command(epilog="Example: kilotwin grid run --can socketcand:127.0.0.1")
def run(buses: Buses = None, size: Size = None, takeover: Takeover = False) -> None:
    """Start the modules, which tell robots to run. Nothing is recorded."""
    with _console(buses, size, takeover) as console:
        console.run()
    typer.echo("modules and robots run")


@app.command(epilog="Example: kilotwin grid pause --can socketcand:127.0.0.1")
def pause(buses: Buses = None, size: Size = None, takeover: Takeover = False) -> None:
    """Stop robots where they are; `grid run` lets them go on."""
    with _console(buses, size, takeover) as console:
        console.pause()
    typer.echo("robots pause, modules are idle")


@app.command(epilog="Example: kilotwin grid idle --can socketcand:127.0.0.1")
def idle(buses: Buses = None, size: Size = None, takeover: Takeover = False) -> None:
    """Leave robots and modules idle, whatever they do."""
    with _console(buses, size, takeover) as console:
        console.idle()
    typer.echo("robots and modules are idle")


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin grid send sleep --can socketcan:can0\n\n"
    "  kilotwin grid send user --type 5 --data 1,2,0xff --can socketcand:127.0.0.1"
)
def send(
    message: Annotated[
        str, typer.Argument(help="run, pause, sleep, reset, voltage, charge, or user.")
    ],
    *,
    kind: Annotated[
        int | None,
        typer.Option("--type", min=0, max=127, help="user: the message's type."),
    ] = None,
    data: Annotated[
        str | None,
        typer.Option("--data", help="user: up to nine bytes, with commas."),
    ] = None,
    hold_s: Annotated[
        float,
        typer.Option("--hold-s", min=0.1, max=3600, help="How long it is repeated."),
    ] = 3.0,
    buses: Buses = None,
    size: Size = None,
    takeover: Takeover = False,
) -> None:
    """Have all cells repeat one message for robots, then leave modules idle."""
    bytes_ = message_for_robots(message, kind, data)
    with _console(buses, size, takeover) as console:
        console.send(bytes_, hold_s)
    typer.echo(f"robots have been told: {message}")


def _console(
    buses: list[str] | None,
    size: str | None,
    takeover: bool,
    experiment: Experiment | None = None,
) -> Console:
    return Console.open(buses or [], size, experiment, takeover=takeover)
