"""A run as the parent passes it to its worker process."""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.trail import Trail
from kilotwin.session.acts import Act
from kilotwin.session.faster_code import Files

if TYPE_CHECKING:
    from kilotwin.table.environment.poses import Address


FEW_ROBOTS = 4_000
"""With fewer, threads wait for one another longer than they save (docs/performance.md)."""
_MOST_THREADS = 8  # if engine.threads is left out

Device = Literal["ohc", "dispatcher"]
"""A device of a served table that has a serial port."""


@dataclass(frozen=True)
class Probes:
    """Looks into robots on an ATmega328P."""

    gdb: int | None = None  # the uid of the robot that gdb controls
    gdb_port: int = 1234
    vcd: tuple[int, ...] = ()  # uids of those whose pins are traced


@dataclass(frozen=True)
class Serving:
    """How robots wait for a host, and a table does. `interfaces` of the kernel, one per bus, are
    in place of the server.

    `speed`: simulated seconds per second; infinite for as fast as it goes. `links`: names for the
    ports of devices. `poses`: where a camera above the robots sends their poses.
    """

    port: int | None = None
    interfaces: tuple[str, ...] = ()
    speed: float = 1.0
    links: Mapping[Device, Path] = field(default_factory=dict)
    poses: "Address | None" = None

    def ohc_links(self, experiment: Experiment) -> list[Path | None]:
        """A name for each overhead controller's port: of several, `ohc-1`, `ohc-2` and so on."""
        number, link = len(experiment.keys.overhead), self.links.get("ohc")
        if number < 2 or link is None:
            return [link] * max(number, 1)
        return [link.with_name(f"{link.name}-{one}") for one in range(1, number + 1)]

    def names(self, experiment: Experiment) -> list[Path]:
        """Names for ports, as far as they are given."""
        links = [*self.ohc_links(experiment), self.links.get("dispatcher")]
        return [link for link in links if link is not None]

    def check(self, experiment: Experiment) -> None:
        """InputError if the experiment has no such table."""
        if experiment.keys.step:
            where = experiment.origin.where(("step", 0))
            raise InputError(f"{where}: a served table has no [[step]]; remove it")
        if experiment.plan is None:
            given = {
                "--can": bool(self.interfaces),
                "--port": self.port is not None,
                "--link-dispatcher": "dispatcher" in self.links,
            }
            for option in (name for name, is_given in given.items() if is_given):
                what = f"{experiment.origin.source} has no [grid], so no CAN buses"
                raise InputError(f"{option}: {what}; leave it out, or add [grid]")
            return
        buses = experiment.plan.layout.buses
        if self.interfaces and len(self.interfaces) != buses:
            number = len(self.interfaces)
            named = "one interface is" if number == 1 else f"{number} interfaces are"
            has = "one bus" if buses == 1 else f"{buses} buses"
            what = f"{named} named, but the grid has {has}"
            raise InputError(f"--can: {what}; give --can once per bus")


@dataclass(frozen=True)
class Job:
    """One run; `guests` are the files of the built programs, one per group of the experiment.

    `module_guest` is that of a grid's modules, "" without a grid.
    """

    experiment: Experiment
    guests: list[str]
    folder: Path
    manifest: dict[str, Any]
    black_box: str | None
    module_guest: str = ""
    serving: Serving | None = None
    """Robots wait for a host from outside, as a grid does, in place of one that has its own."""
    probes: Probes = Probes()
    covered: bool = False
    """Guests mark what runs, and the worker hands the marks back."""
    symbols: tuple[Path | None, ...] = ()
    """Debug information of the guests, then of the modules' (Guest.symbols)."""
    functions_outside: bool = False
    """Metrics' functions are called by the parent, whose answers come on stdin."""
    acts: tuple[Act, ...] = ()
    """Acts in the run that this one repeats."""
    trails: tuple[Trail, ...] = ()
    """A trail to keep, or none."""
    faster: tuple[Files, ...] = ()
    """Code that is made beside the run, and taken over when it is there."""
    listen_to: tuple[int, ...] = ()
    """Robots whose messages are reported, those of the first ..."""
    listen_s: float = 0
    """... seconds, for their programs' twins."""
    viewers: tuple[int, ...] = ()
    """The worker's ends of sockets to viewers, inherited; see session/live_link.py."""
    speed: float = math.inf
    """How many times real time it goes once a page of the viewer is open, for which it waits;
    infinite: as fast as it can, and at once."""
    threads: int = 1
    """So many step its world."""

    @property
    def all_guests(self) -> list[str]:
        """Those of robots, then that of modules."""
        return [*self.guests, *([self.module_guest] if self.module_guest else [])]


def threads_for(experiment: Experiment) -> int:
    """So many threads step the world of a run that has the computer for itself: `engine.threads`;
    where it is left out one for few robots, else one for each core."""
    asked = experiment.keys.engine.threads
    if asked is not None:
        return asked
    if experiment.size < FEW_ROBOTS:
        return 1
    return min(len(os.sched_getaffinity(0)), _MOST_THREADS)
