"""`kilotwin robots ...`: orders for all robots by infrared light, and how they are."""

import json
import math
import sys
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.live import Live
from rich.text import Text

from kilotwin.commands import steps
from kilotwin.commands.options import Buses, Json, Quiet, Size
from kilotwin.commands.robots_via import RobotsVia, link_to_robots
from kilotwin.errors import EXIT_ROBOTS_FAILED, InputError
from kilotwin.experiment.spec.overhead import readuid
from kilotwin.table.grid.console import message_for_robots
from kilotwin.table.links.robot_link import RobotLink
from kilotwin.table.links.roll_call import RollCall, colours

app = typer.Typer(
    help="Gives orders to all robots by infrared light, and asks them how they are.",
    epilog="Robots with Kilotwin's runtime answer on a Kilogrid whose modules have Kilotwin's "
    "firmware; elsewhere look at their lights. docs/lab.md says more.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

# Robots that sleep look round each 8.2 s for 10 ms, in which a frame must begin (hardware.md 1.3):
# in 48 s they have done so six times.
_WAKE_S = 50.0
# A device is told anew after so long, so that progress can be shown.
_PART_S = 10.0
_QUIET_QUESTIONS = 4
_UID_BITS = 16

Hold = Annotated[
    float,
    typer.Option("--hold-s", min=0.1, max=3600, help="How long it is repeated."),
]


def _examples(*lines: str) -> str:
    return "Example:\n\n" + "\n\n".join(f"  kilotwin robots {line}" for line in lines)


def _add_order(name: str, says: str, example: str, usual_s: float = 3.0) -> None:
    """Adds a verb for an order that is nothing but its type."""

    @app.command(name, help=says, epilog=_examples(example))
    def order(
        *,
        via: RobotsVia,
        buses: Buses = None,
        size: Size = None,
        hold_s: Hold = usual_s,
        as_json: Json = False,
        quiet: Quiet = False,
    ) -> None:
        with link_to_robots(via, buses, size) as link:
            _order(link, name, hold_s, as_json, quiet)


_add_order(
    "run",
    "Have robots run their program, from its setup() or where they paused.",
    "run --via grid --can socketcan:can0 --size 10x5",
)
_add_order(
    "pause",
    "Stop robots where they are; `run` lets them go on.",
    "pause --via ohc:/dev/ttyUSB0",
)
_add_order(
    "reset",
    "Start programs anew: all that they knew is gone, and they wait for RUN.",
    "reset --via grid --can socketcand:127.0.0.1",
)
_add_order(
    "sleep",
    "Send robots to sleep. `wakeup` takes 50 s: sleeping they look round each 8 s only.",
    "sleep --via ohc:/dev/ttyUSB0",
)
_add_order(
    "wakeup",
    "Wake robots, which then are idle. Repeated for 50 s: each 8 s they look round for 10 ms.",
    "wakeup --via ohc:/dev/ttyUSB0",
    _WAKE_S,
)
_add_order(
    "charge",
    "Have robots show whether they charge: they blink red while they do.",
    "charge --via ohc:/dev/ttyUSB0",
)


@app.command(
    epilog=_examples(
        "voltage --via grid --can socketcan:can0 --size 10x5", "voltage --via ohc:/dev/ttyUSB0"
    )
)
def voltage(
    *,
    via: RobotsVia,
    buses: Buses = None,
    size: Size = None,
    hold_s: Hold = 3.0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Ask robots for their battery's voltage, or have them show it. 4 if none answers.

    Where answers come back there is a table, and robots go on with what they do.
    """
    with link_to_robots(via, buses, size) as link:
        if link.verifies:
            _table(link, as_json, quiet)
            return
        _order(link, "voltage", hold_s, as_json, quiet)
    if not as_json:
        typer.echo(f"they show it until they are told something else: {colours()}")


@app.command(
    epilog=_examples(
        "uid --via grid --can socketcan:can0 --size 10x5", "uid --via ohc:/dev/ttyUSB0"
    )
)
def uid(
    *,
    via: RobotsVia,
    buses: Buses = None,
    size: Size = None,
    bits: Annotated[
        int,
        typer.Option(min=1, max=_UID_BITS, help="How many bits of it are shown."),
    ] = 8,
    hold_s: Hold = 4.0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Ask robots for their uids, or have them show them bit by bit. 4 if none answers.

    Where no answers come back, robots turn left while a bit is shown that their uid has.
    """
    with link_to_robots(via, buses, size) as link:
        if link.verifies:
            _table(link, as_json, quiet)
            return
        note = steps.note(quiet)
        for bit in range(bits):
            note(f"bit {bit}: robots that turn left now have {1 << bit} in their uid")
            link.repeat(readuid(bit), hold_s)
        link.repeat(message_for_robots("pause", None, None), hold_s)
    shown = {"shown_bits": bits, "hold_s": hold_s}
    typer.echo(
        json.dumps(shown)
        if as_json
        else "a robot's uid is the sum of the numbers that it turned at"
    )


@app.command(epilog=_examples("send --type 5 --data 1,2,0xff --via ohc:/dev/ttyUSB0"))
def send(
    *,
    via: RobotsVia,
    kind: Annotated[int, typer.Option("--type", min=0, max=127, help="The type.")],
    data: Annotated[str | None, typer.Option("--data", help="Up to nine bytes.")] = None,
    buses: Buses = None,
    size: Size = None,
    hold_s: Hold = 3.0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Repeat a message of your own to the programs of all robots."""
    message = message_for_robots("user", kind, data)
    with link_to_robots(via, buses, size) as link:
        _repeat(link, message, f"message of type {kind}", hold_s, quiet)
    told = {"told": "user", "type": kind, "data": list(message[:-1]), "hold_s": hold_s}
    typer.echo(json.dumps(told) if as_json else f"robots have been sent a message of type {kind}")


@app.command(epilog=_examples("watch --via grid --can socketcan:can0 --size 10x5"))
def watch(*, via: RobotsVia, buses: Buses = None, size: Size = None) -> None:
    """Show a table of all robots, again and again, until Ctrl-C."""
    with link_to_robots(via, buses, size) as link:
        _must_answer(link, "watch")
        roll_call = RollCall(link)
        try:
            _watch(roll_call)
        except KeyboardInterrupt:
            typer.echo(f"{len(roll_call.robots)} robots have answered", err=True)


def _order(link: RobotLink, name: str, hold_s: float, as_json: bool, quiet: bool) -> None:
    """An order that is nothing but its type."""
    _repeat(link, message_for_robots(name, None, None), name, hold_s, quiet)
    told = {"told": name, "hold_s": hold_s}
    typer.echo(json.dumps(told) if as_json else f"robots have been told: {name}")


def _repeat(link: RobotLink, message: bytes, name: str, hold_s: float, quiet: bool) -> None:
    display = steps.display(quiet)
    parts = max(1, math.ceil(hold_s / _PART_S))
    try:
        display.step(f"{name}, for {hold_s:g} s")
        for part in range(parts):
            display.part(part / parts)
            link.repeat(message, hold_s / parts)
    finally:
        display.stop()


def _must_answer(link: RobotLink, verb: str) -> None:
    if not link.verifies:
        raise InputError(f"{verb}: no answers come back by {link.name}; name a grid by --via grid")


def _table(link: RobotLink, as_json: bool, quiet: bool) -> None:
    """All that robots say; 4 if none does."""
    display = steps.display(quiet)
    roll_call = RollCall(link)
    try:
        display.step("asking robots")
        roll_call.ask_until(_QUIET_QUESTIONS)
    finally:
        display.stop()
    told: list[dict[str, Any]] = roll_call.as_list()
    typer.echo(json.dumps(told) if as_json else roll_call.text())
    if not told:
        typer.echo(
            "robots that sleep do not answer, nor do other runtimes or other modules; "
            "`kilotwin grid send voltage` has robots show it",
            err=True,
        )
        raise typer.Exit(EXIT_ROBOTS_FAILED)


def _watch(roll_call: RollCall) -> None:
    """On a terminal in its place, elsewhere one table after the other."""
    if not sys.stdout.isatty():
        while True:
            roll_call.ask()
            typer.echo(roll_call.text())
    with Live(console=Console(), auto_refresh=False) as live:
        while True:
            roll_call.ask()
            live.update(Text(roll_call.text()), refresh=True)
