"""Which robots of an experiment are informed, and for which site."""

from kilotwin.experiment.checks.experiment import swarm_size
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.spec.informed_counts import informed_count, split


def informed_for(experiment: ExperimentSchema) -> dict[str, int]:
    """Robots informed for each site, in the order of the sites, zeros included."""
    swarm = experiment.swarm
    shares = {site.name: swarm.informed_for.get(site.name, 0.0) for site in experiment.site}
    return split(informed_count(swarm_size(experiment), swarm.informed), shares)


def informed_ranges(experiment: ExperimentSchema) -> list[tuple[int, int, int]]:
    """(site number, first id, count): informed robots come first, site after site."""
    ranges: list[tuple[int, int, int]] = []
    first = 0
    for number, count in enumerate(informed_for(experiment).values(), start=1):
        if count:
            ranges.append((number, first, count))
        first += count
    return ranges
