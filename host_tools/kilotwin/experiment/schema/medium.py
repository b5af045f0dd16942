"""The media by which robots receive each other: `[medium]`, and what the host knows of each.

The engine's class of a medium is one of emulator/infrared/channel.h.
"""

from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

from kilotwin.experiment.schema.profile_defaults import Defaults
from kilotwin.experiment.schema.section import Length, Section, Share, Spread

MediumName = Literal["ideal", "kilobot"]


class Medium(Section):
    """How robots receive each other; centre to centre. `ideal` has `kind` and `range_m` only."""

    kind: MediumName
    """`ideal`: all in range receive everything. `kilobot`: the infrared of real robots."""
    range_m: Length
    """Distance up to which a robot is received."""
    range_spread: Spread | None = None
    """The range between robots: standard deviation, share."""
    loss: Share | None = None
    """Share of frames lost by chance, near the sender."""
    loss_at_range: Share | None = None
    """The same at the end of the range; between, it grows with the distance's 4th power."""
    overhead_loss: Share | None = None
    """Share of an overhead controller's frames lost by chance. A guess."""
    gain_noise_lsb: Annotated[float, Field(ge=0, le=100)] | None = None
    """Noise of the two readings from which a distance is estimated: standard deviation."""
    distance_error_mm: Annotated[float, Field(ge=0, le=20)] | None = None
    """A robot's constant error of all distances: standard deviation between robots. With the
    default 95 of 100 are within 2 mm, as published. Robots with tables of a lab have none."""
    carrier_sense: bool | None = None
    """Whether a robot that sees light delays its frame."""
    collisions: bool | None = None
    """Whether frames that overlap at a receiver are lost there."""
    half_duplex: bool | None = None
    """Whether a robot receives nothing while it transmits."""
    held_busy: bool | None = None
    """For tests: a light that never goes out, so that no robot transmits."""
    clock_spread: Annotated[float, Field(ge=0, le=0.05)] | None = None
    """The oscillator's rate between robots: standard deviation, share."""
    sensitivity_spread: Spread | None = None
    """The receivers' sensitivity between robots: standard deviation, share."""


@dataclass(frozen=True)
class MediumKind:
    """Facts of a medium. `keys`: those of [medium] that it has, with their defaults. `of_reading`:
    keys of [reading] that it obeys."""

    robot_cpu_s: float
    """CPU time for a second of a native robot: the median of labs' programs."""
    has_pulses: bool
    """Whether it carries pulses, which chips transmit and receive."""
    counts_by_robot: bool
    """Whether frames transmitted are judged robot by robot, not by their mean."""
    keys: Defaults = field(default_factory=dict)
    of_reading: tuple[str, ...] = ()


MEDIA: dict[str, MediumKind] = {
    "ideal": MediumKind(
        robot_cpu_s=1 / 600_000,
        has_pulses=False,
        counts_by_robot=False,
        of_reading=("line_of_sight",),
    ),
    "kilobot": MediumKind(
        robot_cpu_s=1 / 400_000,
        has_pulses=True,
        counts_by_robot=True,
        keys={
            "range_spread": 0.05,
            "loss": 0.02,
            "loss_at_range": 0.2,
            "overhead_loss": 0.02,
            "gain_noise_lsb": 2.0,
            "distance_error_mm": 1.0,  # hardware.md 2: 2 mm is taken as two sd
            "carrier_sense": True,
            "collisions": True,
            "half_duplex": True,
            "held_busy": False,
            "clock_spread": 0.005,
            "sensitivity_spread": 0.05,
        },
    ),
}
MEDIUM_DEFAULTS: Defaults = {
    key: value for medium in MEDIA.values() for key, value in medium.keys.items()
}
"""Defaults of all keys that a medium has of its own."""
