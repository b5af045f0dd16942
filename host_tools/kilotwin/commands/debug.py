"""`kilotwin debug`: a run repeated, and a robot in it held by gdb, which can go back in time."""

import socket
import subprocess
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands import steps
from kilotwin.commands.gdb_programs import find_gdb
from kilotwin.commands.options import (
    ConfineMode,
    Quiet,
    Seed,
    Settings,
    Trust,
    command_app,
    given_settings,
)
from kilotwin.errors import InputError, cause_of
from kilotwin.files import confinement
from kilotwin.session.debug.gdb_server import GdbServer
from kilotwin.session.debug.repeated_run import Repeated, moment, travel_in

app = command_app()


@app.command(
    epilog="Examples:\n\n  kilotwin debug runs/my-run --robot 17 --at 312\n\n"
    "  kilotwin debug my.toml --seed 7 --robot 3\n\n"
    "  kilotwin debug runs/my-run --robot 17 --at 312 --port 3333"
)
def debug(
    target: Annotated[
        Path, typer.Argument(metavar="RUN|EXPERIMENT", help="A run folder, or an experiment file.")
    ],
    *,
    robot: Annotated[
        int | None, typer.Option(metavar="UID", help="Its uid; the first robot, if left out.")
    ] = None,
    at: Annotated[
        float | None, typer.Option("--at", metavar="SECONDS", help="Hold it at that moment.")
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(
            min=1024, max=65535, metavar="PORT", help="Start no gdb, wait for one at this port."
        ),
    ] = None,
    seed: Seed = None,
    settings: Settings = None,
    confine: ConfineMode = None,
    trust: Trust = False,
    quiet: Quiet = False,
) -> None:
    """Repeat a run and hold a robot in it with gdb, line by line, forwards and backwards."""
    confinement.choose(confine, trust)
    note = steps.note(quiet)
    repeated = Repeated.of(target, given_settings(settings, seed))
    at_s = moment(at, repeated.duration_s)
    uid = repeated.experiment.uid_of(0) if robot is None else robot
    held = repeated.experiment.robot_named(uid, "--robot")
    gdb = None if port is not None else _gdb()
    with _listening(port or 0) as listener, travel_in(repeated, [held], note) as (travel, symbols):
        here = listener.getsockname()[1]
        note(f"repeating the run up to {at_s:g} s")
        travel.start([held], at_s)
        note(f"robot {uid} stands at {travel.chip(held).at_s:.6f} s; monitor help says more")
        words = [str(symbols[held]), "-ex", f"target remote :{here}"]
        server = GdbServer(travel, repeated.experiment, symbols, repeated.result_hash)
        if gdb is None:
            typer.echo(f'type: avr-gdb {words[0]} -ex "{words[2]}"')
            with listener.accept()[0] as client:
                server.serve(client)
            return
        with subprocess.Popen([gdb, "-q", *words]) as child:
            with listener.accept()[0] as client:
                server.serve(client)
            child.wait()
    typer.echo(f"what led to it: kilotwin view {target}")


def _gdb() -> str:
    gdb = find_gdb()
    if gdb is None:
        what = "no gdb for AVR is here; type: apt-get install gdb-avr, or give --port"
        raise InputError(f"{what} for one elsewhere")
    return gdb


def _listening(port: int) -> socket.socket:
    """On this computer alone."""
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(("127.0.0.1", port))
    except OSError as error:
        listener.close()
        raise InputError(f"--port {port}: {cause_of(error)}; name another") from None
    listener.listen(1)
    return listener
