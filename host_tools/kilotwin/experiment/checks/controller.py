"""Checks that concern several keys of [controller] and of who is informed.

Each problem is what is wrong and what to do, and the path of the key.
"""

import math
from collections.abc import Iterator, Sequence

from kilotwin.experiment.schema.controller import Controller, InformedShares
from kilotwin.experiment.schema.section import LAST_UID

KeyPath = tuple[str, ...]

_SHARE_ERROR = 1e-6


def informed_problems(
    swarm: InformedShares, controller: Controller | None, sites: Sequence[str], size: int
) -> Iterator[tuple[str, KeyPath]]:
    """Problems of a swarm of that size in an experiment with these sites."""
    for name in swarm.informed_for:
        if name not in sites:
            known = ", ".join(sites) or "there are none"
            what = f"there is no site '{name}'; the sites are: {known}"
            yield what, ("swarm", "informed_for", name)
    total = math.fsum(swarm.informed_for.values())
    if swarm.informed_for and abs(total - 1) > _SHARE_ERROR:
        what = f"the shares of swarm.informed_for sum to {total:g}; make the sum 1"
        yield what, ("swarm", "informed_for")
    if swarm.informed == 0:
        return
    wanting = ""
    if not swarm.informed_for:
        wanting = "informed for which site? Add [swarm.informed_for] with shares that sum to 1"
    elif controller is None:
        wanting = "robots learn by CONFIG what they are informed for; add [controller]"
    elif size > LAST_UID:
        wanting = f"CONFIG reaches robots 1 to {LAST_UID}; take fewer robots, or informed = 0"
    if wanting:
        yield wanting, ("swarm", "informed")


def controller_problems(controller: Controller | None) -> Iterator[tuple[str, KeyPath]]:
    """Problems that [controller] has by itself."""
    if controller and controller.neighbour_timeout_s < controller.neighbour_window_s:
        what = (
            f"neighbours are forgotten after {controller.neighbour_timeout_s:g} s, before their "
            f"window of {controller.neighbour_window_s:g} s ends; make it as long at least"
        )
        yield what, ("controller", "neighbour_timeout_s")
