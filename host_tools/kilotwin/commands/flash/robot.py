"""`kilotwin flash robot`: one robot, by a programmer."""

import contextlib
import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands import steps
from kilotwin.commands.flash.file import Display, File, Force, hex_of, is_built
from kilotwin.commands.options import Define, Include, Json, Quiet, typed_command
from kilotwin.table.flash import eeprom_files, loader
from kilotwin.table.flash.avrdude import Wiring, program_path
from kilotwin.table.flash.chip import EEPROM_BYTES
from kilotwin.table.flash.image import application_of
from kilotwin.table.flash.robot import Job, RobotFlasher, check_answers
from kilotwin.table.ports.holders import reserved

EXAMPLES = (
    "Examples:\n\n"
    "  kilotwin flash robot my.c --via isp\n\n"
    "  kilotwin flash robot my.hex --via isp -c stk500v2 -P /dev/ttyUSB0 --dry-run"
)


class Via(StrEnum):
    """How one robot is reached."""

    ISP = "isp"


ViaOption = Annotated[Via, typer.Option(help="How: isp is a programmer on the robot's pins.")]
Programmer = Annotated[
    str, typer.Option("-c", envvar="KILOTWIN_PROGRAMMER", help="Its kind, as avrdude names it.")
]
Port = Annotated[
    str, typer.Option("-P", envvar="KILOTWIN_PROGRAMMER_PORT", help="Where it is plugged in.")
]
BitClock = Annotated[
    float | None,
    typer.Option("-B", min=0.1, envvar="KILOTWIN_BIT_CLOCK_US", help="Go slower: us per bit."),
]
BaudRate = Annotated[
    int | None,
    typer.Option("-b", min=1, envvar="KILOTWIN_BAUD", help="Of the programmer's serial line."),
]
LoaderOption = Annotated[
    str | None,
    typer.Option(
        "--loader",
        metavar="FILE|keep|none",
        help="The boot loader: Kilotwin's if not given.",
    ),
]
Eeprom = Annotated[
    Path | None,
    typer.Option(help="Write this EEPROM in place of the chip's."),
]
Keep = Annotated[Path, typer.Option(help="The folder where EEPROMs are kept.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Read the chip, write nothing.")]


def robot(
    file: File,
    *,
    via: ViaOption,
    programmer: Programmer = "avrispmkII",
    port: Port = "usb",
    bit_clock: BitClock = None,
    baud_rate: BaudRate = None,
    loader_file: LoaderOption = None,
    eeprom: Eeprom = None,
    keep: Keep = Path("eeprom"),
    include: Include = None,
    define: Define = None,
    force: Force = False,
    dry_run: DryRun = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a program and the boot loader into one robot by a programmer, and verify them.

    Chip, fuses and lock bits are looked at first; calibration and uid in the EEPROM stay.
    """
    assert via is Via.ISP
    program_path()
    display = steps.display(quiet)
    built = is_built(file, include, define)
    wiring = Wiring(programmer, port, _options(bit_clock, baud_rate))
    with contextlib.ExitStack() as ending:
        ending.callback(display.stop)
        if not built:
            # Building and its checks take half a minute.
            ending.enter_context(reserved(port))
            check_answers(wiring, display)
        application = application_of(hex_of(file, include, define, force=force, display=display))
        if eeprom is not None:
            eeprom_files.read(eeprom, b"\xff" * EEPROM_BYTES)
        job = Job(
            wiring=wiring,
            application=application,
            loader=loader.choose(loader_file, application, display.step),
            eeprom=eeprom,
            keep=keep,
            again=typed_command(),
        )
        if built:
            ending.enter_context(reserved(port))
        _flash(job, display, dry_run=dry_run, as_json=as_json)


def _flash(job: Job, display: Display, *, dry_run: bool, as_json: bool) -> None:
    """Prints the chip before it is written; JSON at the end, also of a chip that was refused."""
    flasher = RobotFlasher(job, display)
    outcome = flasher.look()
    display.stop()
    if not as_json:
        typer.echo(outcome.chip.text())
    for warning in outcome.warnings:
        display.note(f"note: {warning}")
    try:
        flasher.check(outcome)
        if not dry_run:
            flasher.write(outcome)
    finally:
        display.stop()
        if as_json:
            typer.echo(json.dumps(outcome.as_dict()))
    if not as_json:
        typer.echo(outcome.text())


def _options(bit_clock: float | None, baud_rate: int | None) -> tuple[str, ...]:
    clock = () if bit_clock is None else ("-B", f"{bit_clock:g}")
    return clock if baud_rate is None else (*clock, "-b", str(baud_rate))
