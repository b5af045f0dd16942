"""Which robots are informed, and for which site."""

from collections.abc import Mapping
from decimal import ROUND_FLOOR, ROUND_HALF_UP, Decimal

from kilotwin.experiment.checks import swarm_size
from kilotwin.experiment.schema import ExperimentSchema


def informed_count(size: int, share: float) -> int:
    """`share` of the robots, halves up. Decimal: 0.29 of 50 is 14.5 and not a hair less."""
    return int((Decimal(repr(share)) * size).quantize(Decimal(1), ROUND_HALF_UP))


def split(count: int, shares: Mapping[str, float]) -> dict[str, int]:
    """Robots per site by largest remainder; of equal remainders the earlier site's is larger.

    For two sites this is the paper's rule: halves up for the first, the rest for the second.
    """
    exact = {name: Decimal(repr(share)) * count for name, share in shares.items()}
    whole = {name: int(part.quantize(Decimal(1), ROUND_FLOOR)) for name, part in exact.items()}
    by_remainder = sorted(exact, key=lambda name: whole[name] - exact[name])
    for name in by_remainder[: count - sum(whole.values())]:
        whole[name] += 1
    return whole


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
