"""`kilotwin serve ...`: devices that are emulated by themselves, for programs outside."""

import json
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands import steps
from kilotwin.commands.options import Json, Quiet
from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.table.flash.served_programmer import ServedProgrammer

app = typer.Typer(
    help="Emulates a device on a serial port, for other programs, until Ctrl-C.",
    epilog="A whole table for a host, with robots and CAN buses, is `kilotwin run EXP.toml "
    "--serve`.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


@app.callback()
def devices() -> None:
    """Keeps a name for each device, although there is one."""


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin serve programmer --chip robot.hex --link isp\n\n"
    "  kilotwin flash robot my.c --via isp -c stk500v2 -P isp     (in another terminal)"
)
def programmer(
    chip: Annotated[
        Path | None,
        typer.Option(
            envvar="KILOTWIN_CHIP",
            help="Keep the chip in this file: flash, EEPROM, fuses, lock bits, signature. "
            '`[\\[robots]] hex = "FILE"` runs it. A new chip if there is no such file.',
        ),
    ] = None,
    link: Annotated[
        Path | None,
        typer.Option(envvar="KILOTWIN_LINK", help="Also give the port this name."),
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
