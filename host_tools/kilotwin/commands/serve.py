"""`kilotwin serve ...`: a world or a device that is emulated for programs outside."""

import json
import math
import sys
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands import steps
from kilotwin.commands.options import (
    ConfineMode,
    File,
    Json,
    NoBrowser,
    Quiet,
    RunFolder,
    Seed,
    Settings,
    Speed,
    Trust,
    View,
    ViewPort,
    given_settings,
)
from kilotwin.commands.run import Shown, tell
from kilotwin.commands.window import stay
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import Setting
from kilotwin.files import confinement
from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.session.job import Device, Serving
from kilotwin.session.run import run
from kilotwin.table.environment.poses import parse_address
from kilotwin.table.flash.served_programmer import ServedProgrammer

app = typer.Typer(
    help="Emulates a table with robots, or a device, for programs outside.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin serve world experiments/kilogrid/paper-n50.toml\n\n"
    "  kilotwin record experiments/kilogrid/paper-n50.toml --can ...     (in another terminal)\n\n"
    "  kilotwin serve world experiments/porting/native-and-avr.toml --link-ohc ohc\n\n"
    "  kilotwin serve world experiments/environment/wall.toml --poses udp:127.0.0.1:5005"
)
def world(
    experiment: File,
    *,
    seed: Seed = None,
    settings: Settings = None,
    out: RunFolder = None,
    port: Annotated[
        int | None,
        typer.Option(min=1, max=65535, help="CAN buses on this port."),
    ] = None,
    can: Annotated[
        list[str] | None,
        typer.Option(
            metavar="INTERFACE",
            envvar="KILOTWIN_SERVE_CAN",
            help="CAN buses on these interfaces of the kernel, one per bus.",
        ),
    ] = None,
    link_ohc: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Also give the overhead controller's port this name.",
        ),
    ] = None,
    link_dispatcher: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="The same for the dispatcher's port.",
        ),
    ] = None,
    poses: Annotated[
        str | None,
        typer.Option(
            metavar="udp:HOST:PORT",
            help="A camera above the robots sends their poses there, as lines of JSON.",
        ),
    ] = None,
    speed: Speed = 1.0,
    fast: Annotated[bool, typer.Option("--fast", help="Do not wait at all.")] = False,
    confine: ConfineMode = None,
    trust: Trust = False,
    view: View = False,
    view_port: ViewPort = 0,
    no_browser: NoBrowser = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Emulate an experiment's robots for a host outside, in real time, and leave a run folder.

    The host finds an overhead controller's serial port and, with a \\[grid], CAN buses.
    """
    confinement.choose(confine, trust)
    camera = None if poses is None else parse_address(poses)
    pace = math.inf if fast else speed
    links: dict[Device, Path | None] = {"ohc": link_ohc, "dispatcher": link_dispatcher}
    given = {device: link for device, link in links.items() if link is not None}
    serving = Serving(port, tuple(can or ()), pace, given, camera)
    # The engine takes frames of the host once in a world step.
    each_tick = Setting(("engine", "step_ticks"), 1, "serve world")
    loaded = Experiment.load(experiment, [each_tick, *given_settings(settings, seed)])
    serving.check(loaded)
    shown = Shown(view, view_port, no_browser, as_json, quiet)
    with shown.display(steers=False) as (display, viewer):
        outcome = run(loaded, out, sys.argv, display, serving=serving, window=viewer)
        tell(outcome, plots=False, as_json=as_json, seen=view)
        if not outcome.stop_asked:
            stay(viewer)
    raise typer.Exit(outcome.exit_code)


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin serve programmer --chip robot.hex --link isp\n\n"
    "  kilotwin flash robot my.c --via isp -c stk500v2 -P isp     (in another terminal)"
)
def programmer(
    chip: Annotated[
        Path | None,
        typer.Option(
            help="Keep the chip in this file: flash, EEPROM, fuses, lock bits, signature. "
            '`[\\[robots]] hex = "FILE"` runs it. A new chip if there is no such file.',
        ),
    ] = None,
    link: Annotated[
        Path | None,
        typer.Option(help="Also give the port this name."),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Offer a programmer (STK500v2) with a simulated ATmega328P in it, until Ctrl-C."""
    ended = False

    def end(number: int, _: object) -> None:
        nonlocal ended
        ended = True

    with heeding_interrupts(end):
        served = ServedProgrammer(chip, link, steps.note(quiet))
        try:
            port = served.terminal.shown
            shown = {"port": served.terminal.port, "link": str(link) if link else None}
            typer.echo(json.dumps(shown) if as_json else f"a programmer is at {port}; type:")
            if not as_json:
                typer.echo(f"  kilotwin flash robot my.c --via isp -c stk500v2 -P {port}")
            while not ended:
                served.step()
        finally:
            served.close()
