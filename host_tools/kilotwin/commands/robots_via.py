"""The option --via of commands that reach robots by infrared, and what it opens."""

import contextlib
from collections.abc import Iterator
from typing import Annotated

import typer

from kilotwin.table.links.robot_link import RobotLink
from kilotwin.table.links.via import forms, open_link, parse_via

RobotsVia = Annotated[
    str,
    typer.Option(
        "--via",
        metavar="KIND[:PORT]",
        envvar="KILOTWIN_ROBOTS_VIA",
        help=f"How robots are reached: {forms()}. A grid has --can, and --size.",
    ),
]


@contextlib.contextmanager
def link_to_robots(via: str, buses: list[str] | None, size: str | None) -> Iterator[RobotLink]:
    """The device, as long as it is needed; InputError or DeviceError if it is not to be had."""
    link = open_link(parse_via(via, buses or (), size))
    try:
        yield link
    finally:
        link.close()
