"""Whether an experiment's programs can be looked at for what runs."""

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import Setting
from kilotwin.files import extras

COVERED = Setting(("swarm", "cpu"), "translated", "--coverage")
"""The setting that runs programs so that it is seen."""


def check_covered(experiment: Experiment) -> None:
    """InputError if no robot's program has sources, or one that has is on an ATmega328P. RunError
    without gcovr, which writes the report."""
    extras.require("gcovr")
    with_sources = [group for group in experiment.groups if group.program.sources]
    if not with_sources:
        raise InputError("--coverage: robots run a .hex, which has no sources; name a program")
    for group in with_sources:
        if group.on_board:
            raise InputError(
                f"--coverage: {group.program.written} has a cpu of its own; leave it out, or set "
                'it to "translated" or "native"'
            )
