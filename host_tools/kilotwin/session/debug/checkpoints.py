"""Which checkpoints of a run are kept: close to one another near the present, farther apart behind
it, bounded in number and in memory; and what has changed between them."""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

MOST = 48
"""So many are kept."""
MOST_BYTES = 512 << 20
"""So much memory they may have of their own, all together."""


FIRST_NOTED = 0x100
"""The address from which on changes are noted: that of SRAM."""


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


@dataclass
class Written:
    """The bytes of a robot's memory that may have changed, from stretch to stretch of the run.

    `ends`: where the stretches end, in ticks; the first of them begins at `begin`. `bytes_of`:
    their bytes, each a bit.
    """

    robot: int
    begin: int
    ends: list[int] = field(default_factory=list)
    bytes_of: list[int] = field(default_factory=list)

    def add(self, begin: int, end: int, addresses: Iterable[int]) -> None:
        """Another stretch, of which a part that is known already is left out."""
        known = self.ends[-1] if self.ends else self.begin
        if begin <= known < end:
            self.ends.append(end)
            self.bytes_of.append(sum(1 << address for address in addresses))

    def may_be_in(self, begin: int, end: int, address: int, length: int) -> bool:
        """Whether one of these bytes may have changed between two ticks.

        The stretches before and behind count too: a robot may stand a little farther than the
        world, and what repeats was noted where it began (robots/translated/written_bytes.h).
        """
        if address < FIRST_NOTED or begin < self.begin or not self.ends or end >= self.ends[-1]:
            return True
        first = bisect_right(self.ends, begin)
        last = bisect_left(self.ends, end)
        bits = ((1 << length) - 1) << address
        return any(bytes_ & bits for bytes_ in self.bytes_of[max(0, first - 1) : last + 2])
