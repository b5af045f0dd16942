"""The `[[step]]` tables of an experiment: acts on the table while it runs."""

from typing import Annotated

from pydantic import Field

from kilotwin.experiment.schema.section import MOST_ROBOTS, Pose, Reading10, Section


class Step(Section):
    """Light that changes during a run, or a robot that is moved by hand.

    Each has `ambient`, `lamp` with `peak`, or `robot` with `pose`. A sample of the same moment is
    taken before.
    """

    at_s: Annotated[float, Field(ge=0, le=1e9)]
    """Seconds from the start of the run; before its end, unless `--set` made the run shorter."""
    ambient: Reading10 | None = None
    """`light.ambient` from then on."""
    lamp: Annotated[int, Field(ge=0, le=9999)] | None = None
    """A [[light.source]] by its place in the file, from 0 ..."""
    peak: Reading10 | None = None
    """... and its `peak` from then on: 0 switches it off."""
    robot: Annotated[int, Field(ge=0, le=MOST_ROBOTS)] | None = None
    """A robot by its uid, 1 for the first robot and so on, unless `uids` or `swarm.lab` say
    others ..."""
    pose: Pose | None = None
    """... which is put there, [x_m, y_m, heading_rad], while its program goes on."""
