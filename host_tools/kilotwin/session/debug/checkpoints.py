"""Which checkpoints of a run are kept: close to one another near the present, farther apart behind
it, bounded in number and in memory."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

MOST = 48
"""So many are kept."""
MOST_BYTES = 512 << 20
"""So much memory they may have of their own, all together."""


@dataclass(frozen=True)
class Checkpoint:
    """A forked world that stands at the begin of a tick. `slot`: the link to it; `process`: its
    id."""

    tick: int
    slot: int
    process: int


def least_needed(ticks: Sequence[int], now: int) -> int:
    """The index of the one of three or more `ticks`, in order, that can go: the one whose gap would
    be the smallest for how long ago it is. Neither the first nor the last."""

    def cost(index: int) -> float:
        gap = ticks[index + 1] - ticks[index - 1]
        return gap / max(1, abs(now - ticks[index]))

    return min(range(1, len(ticks) - 1), key=cost)


def latest(checkpoints: Iterable[Checkpoint], tick: int) -> Checkpoint | None:
    """The last one at or before `tick`, of some in order of time; None if there is none."""
    before = [one for one in checkpoints if one.tick <= tick]
    return before[-1] if before else None


def on_the_way(begin: int, end: int) -> list[int]:
    """Ticks between two, at which checkpoints make the way back from `end` quick: each time half as
    far from it."""
    out = []
    left = end - begin
    while left > 3:
        left //= 2
        out.append(end - left)
    return out
