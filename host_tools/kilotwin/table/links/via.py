"""How a user names a way to robots: `--via grid` with --can and --size, `--via KIND:PORT`."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from kilotwin.errors import InputError
from kilotwin.table.can.buses import close_all, open_all
from kilotwin.table.grid.console import named_grid
from kilotwin.table.links.dispatcher_robots import DispatcherRobots
from kilotwin.table.links.grid_robots import open_grid
from kilotwin.table.links.overhead_robots import OverheadRobots
from kilotwin.table.links.robot_link import RobotLink
from kilotwin.table.ports.holders import reserved


@dataclass(frozen=True)
class Via:
    """A way to robots, as it was named."""

    kind: str
    port: str = ""
    buses: Sequence[str] = ()
    """A grid's, as --can names them."""
    size: str | None = None
    """A grid's, "COLUMNSxROWS"."""

    def __str__(self) -> str:
        return f"{self.kind}:{self.port}" if self.port else self.kind


@dataclass(frozen=True)
class Kind:
    """A kind of device: what stands behind its colon, and how it is opened."""

    port: str
    """Description of the port, for people; "" if the kind has none."""
    open: Callable[[Via], RobotLink]


KINDS: dict[str, Kind] = {
    "grid": Kind("", lambda via: open_grid(via.buses, via.size)),
    "ohc": Kind("PORT", lambda via: OverheadRobots(via.port)),
    "dispatcher": Kind("PORT[@BAUD]", lambda via: DispatcherRobots(via.port)),
}
"""By the word before the colon."""


def forms() -> str:
    """All forms that --via may have, for people."""
    return ", ".join(
        f"{kind}:{entry.port}" if entry.port else kind for kind, entry in KINDS.items()
    )


def parse_via(text: str, buses: Sequence[str] = (), size: str | None = None) -> Via:
    """The link that --via names, with --can and --size; InputError has the forms."""
    kind, colon, port = text.partition(":")
    entry = KINDS.get(kind)
    if entry is None or bool(colon) != bool(entry.port) or bool(port) != bool(entry.port):
        raise InputError(f"--via {text}: allowed: {forms()}")
    if kind != "grid" and (buses or size is not None):
        raise InputError(f"--via {text}: --can and --size are for --via grid; leave them out")
    return Via(kind, port, tuple(buses), size)


def check_there(via: Via) -> None:
    """DeviceError if the device is not there or taken, before long work for it; sends nothing."""
    if via.kind != "grid":
        with reserved(via.port.partition("@")[0]):
            return
    _, buses = named_grid(via.buses, via.size)
    close_all(open_all(buses))


def open_link(via: Via) -> RobotLink:
    """The device, ready for use; DeviceError if it is not there or taken."""
    return KINDS[via.kind].open(via)
