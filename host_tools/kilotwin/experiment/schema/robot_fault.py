"""The `[[faults.robot]]` tables of an experiment: robots that fail."""

from typing import Annotated, Literal

from pydantic import Field

from kilotwin.experiment.schema.section import Section, Share, Uid

RobotFaultKind = Literal["dead", "stuck", "deaf", "mute", "drift"]
# Up to what a motor can do above its calibrated duty (emulator/physics/chassis.cpp).
Factor = Annotated[float, Field(ge=0, le=1.2)]


class RobotFault(Section):
    """Robots that fail, for good or for a while: those that `robots` names, or a `share` of all;
    all without.

    Who fails, and when, depends on the seed, the number of robots and the place of the table in the
    file alone. More of a share or a probability makes more robots fail, none fewer.
    """

    kind: RobotFaultKind
    """`dead`: LED and motors off, silent. `stuck`: it does not move by itself. `deaf`: it receives
    nothing and sees no light of others' messages. `mute`: nobody receives it, and it does not
    notice. `drift`: a motor's speed changes; foot-bots' do not."""
    at_s: Annotated[float, Field(ge=0, le=1e9)]
    """Seconds from the start of the run; before its end, unless `--set` made the run shorter."""
    until_s: Annotated[float, Field(ge=0, le=1e9)] | None = None
    """Each fails at a moment drawn from `at_s` to here, which may be after the end. At `at_s` if
    left out."""
    for_s: Annotated[float, Field(gt=0, le=1e9)] | None = None
    """deaf, mute: how long that lasts; for good if left out."""
    robots: Annotated[list[Uid], Field(min_length=1)] | None = None
    """Those with these uids: 1 for the first robot and so on, unless `uids` or `swarm.lab` say
    others."""
    share: Share | None = None
    """In place of `robots`: a share of all, drawn; rounded to whole robots."""
    probability: Share = 1.0
    """Probability that each of them fails."""
    left: Factor | None = None
    """drift: what the speed of the left motor is multiplied by; 1 if left out."""
    right: Factor | None = None
    """drift: the same of the right motor."""
