"""Whether an experiment's robots run `firmware/aggregation`, whose messages the host knows."""

from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.files.places import names_ours

PROGRAM = "firmware/aggregation"


def runs_aggregation(experiment: ExperimentSchema) -> bool:
    """Whether all robots do: by their program's name, or since there is a [controller] for it."""
    if experiment.controller is not None:
        return True
    kinds = experiment.robots
    programs = [kind.program for kind in kinds] if kinds else [experiment.swarm.program]
    return all(names_ours(program, PROGRAM) for program in programs)
