"""What the parent of a run hands to its worker process."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kilotwin.experiment.experiment import Experiment

if TYPE_CHECKING:
    from kilotwin.runs.served_grid import Serving


@dataclass(frozen=True)
class Probes:
    """Looks into robots on an ATmega328P."""

    gdb: int | None = None  # the robot that gdb controls
    gdb_port: int = 1234
    vcd: tuple[int, ...] = ()  # robots whose pins are traced


@dataclass(frozen=True)
class Job:
    """One run; `guests` are the files of the built programs, one per group of the experiment.

    `module_guest` is that of a grid's modules.
    """

    experiment: Experiment
    guests: list[str]
    folder: Path
    manifest: dict[str, Any]
    black_box: str | None
    module_guest: str | None = None
    serving: "Serving | None" = None
    """A grid that waits for a host, in place of one that has its own."""
    probes: Probes = Probes()
