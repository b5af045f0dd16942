"""How many robots are informed, and how they are split among the sites."""

from collections.abc import Mapping
from decimal import ROUND_FLOOR, ROUND_HALF_UP, Decimal


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
