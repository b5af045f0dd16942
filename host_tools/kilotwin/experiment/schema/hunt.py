"""The `[hunt]` table of an experiment: what `kilotwin hunt` may vary to break it."""

from typing import Annotated

from pydantic import Field

from kilotwin.experiment.schema.section import Reading10, Section, Share

Number = Annotated[int, Field(ge=0, le=1000)]
Spell = Annotated[float, Field(ge=0.1, le=1e6)]
Rate = Annotated[float, Field(ge=0, le=0.05)]


class Hunt(Section):
    """How far `kilotwin hunt` may go from the experiment as it is; the run itself does not depend
    on it. Each default is what happens in a lab.

    Seeds always vary. 0 or false switches a thing off.
    """

    starts: bool = True
    """Whether robots may start elsewhere: in a part of the arena, or turned. Those with `poses`
    stay within a few millimetres, and are turned."""
    uids: bool = True
    """Whether robots may have any uids; not those of a lab, nor beside informed robots."""
    on_s: Annotated[float, Field(ge=0, le=86_400)] = 7200.0
    """Robots may have been on for so long (`swarm.on_s`)."""
    stagger_s: Annotated[float, Field(ge=0, le=600)] = 2.0
    """RUN may reach robots so much later."""
    clock_spread: Rate = 0.02
    """Oscillators may differ so much (`medium.clock_spread`)."""
    loss: Share = 0.4
    """So many frames may be lost (`medium.loss`, `medium.loss_at_range`)."""
    spells: Number = 2
    """So many times a robot may be deaf or mute for a while ..."""
    spell_s: Spell = 20.0
    """... for so long."""
    failing: Number = 1
    """So many robots may fail for good (`[[faults.robot]]`)."""
    resets: Number = 1
    """So many robots may be reset in the run, and told to run again."""
    moved: Number = 2
    """So many times a robot may be put elsewhere, or turned round, by hand."""
    light: Reading10 = 100.0
    """Ambient light may change by so much in the run."""
    battery: bool = True
    """Whether batteries may run down."""
    modules: Number = 1
    """On a grid: so many modules may be reset in the run."""
    can_errors: Annotated[float, Field(ge=0, le=0.5)] = 0.02
    """On a grid: so many CAN frames may be destroyed, and come late (`faults.error_share`)."""
    host_gone_s: Annotated[float, Field(ge=0, le=1e6)] = 5.0
    """On a grid: the host may be gone for so long."""
    mistakes: bool = True
    """Whether a mistake counts that nothing stops: `no_mistake` of `[[expect]]`."""
    undefined: bool = True
    """Whether some trials look for undefined behaviour, natively (`--sanitize`)."""
