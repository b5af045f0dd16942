"""Shrinking: a variation that fails is made as small as it can be and still fails so.

Candidates are tried in batches of fixed size, and the first of a batch that fails is taken: what
comes out does not depend on how many of them run at a time.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from kilotwin.studies.hunt.variation import Addition, Pose, Put, Variation

Fails = Callable[[Sequence[Variation]], Sequence[bool]]
"""Whether each of some variations fails as the one does that is shrunk."""

T = TypeVar("T")
Part = Put | Addition

BATCH = 8
_LEAST_S = 0.5
_MOST_ROUNDS = 6


@dataclass(frozen=True)
class Whole:
    """The experiment before it is shrunk: robots, seconds, the poses with which they began in the
    run that failed, and values of keys that take chance out of it."""

    size: int
    duration_s: float
    poses: tuple[Pose, ...]
    quiet: tuple[Put, ...]


class Shrinker:
    """Shrinks one variation by trials, `most` of them at most."""

    def __init__(self, fails: Fails, whole: Whole, most: int) -> None:
        self._fails = fails
        self._whole = whole
        self._left = most
        self.tried = 0

    def shrunk(self, one: Variation) -> Variation:
        """The smallest found; it fails as `one` does."""
        if self._whole.poses and not one.poses:
            # Fixed where they are, robots stay there when others go.
            one = self._first((replace(one, poses=self._whole.poses),)) or one
        for _ in range(_MOST_ROUNDS):
            before = one
            for step in (
                self._shorter,
                self._fewer_changes,
                self._fewer_robots,
                self._quieter,
                self._plainer,
            ):
                one = step(one)
            if one == before or self._left <= 0:
                break
        return one

    def _first(self, candidates: Iterable[Variation]) -> Variation | None:
        """The first candidate that fails."""
        queue = iter(candidates)
        while self._left > 0:
            batch = [one for _, one in zip(range(min(BATCH, self._left)), queue, strict=False)]
            if not batch:
                return None
            self._left -= len(batch)
            self.tried += len(batch)
            for one, does in zip(batch, self._fails(batch), strict=True):
                if does:
                    return one
        return None

    def _shorter(self, one: Variation) -> Variation:
        """To the shortest time, within a tenth."""
        low, high = 0.0, one.duration_s or self._whole.duration_s
        while high - low > max(_LEAST_S, 0.1 * high) and self._left > 0:
            span = high - low
            times = [round(low + span * part / BATCH, 2) for part in range(1, BATCH)]
            candidates = [cut(one, time_s) for time_s in times if time_s >= _LEAST_S]
            found = self._first(candidates)
            if found is None:
                break
            assert found.duration_s is not None
            high = found.duration_s
            low = max((it for it in times if it < high), default=low)
            one = found
        return one

    def _fewer_robots(self, one: Variation) -> Variation:
        there = one.robots or tuple(range(self._whole.size))
        while len(there) > 1:
            found = self._first(replace(one, robots=some) for some in _smaller(there) if some)
            if found is None:
                break
            one, there = _without_absent(found), found.robots
        return one

    def _fewer_changes(self, one: Variation) -> Variation:
        quiet: list[Part] = [put for put in one.puts if put in self._whole.quiet]
        while parts := _parts_of(one, quiet):
            found = self._first(with_parts(one, (*quiet, *some)) for some in _smaller(parts))
            if found is None:
                break
            one = found
        return one

    def _quieter(self, one: Variation) -> Variation:
        """Without the medium's and the motors' chance: all of it, or key by key."""
        left = [put for put in self._whole.quiet if put not in one.puts]
        if not left:
            return one
        whole = one
        for put in left:
            whole = whole.put(put.path, put.value)
        found = self._first((whole,))
        if found is not None:
            return found
        for put in left:
            one = self._first((one.put(put.path, put.value),)) or one
        return one

    def _plainer(self, one: Variation) -> Variation:
        """Values as they are in the experiment, or rounder."""
        if one.uids:
            one = self._first((replace(one, uids=()),)) or one
        if one.seed is not None:
            one = self._first((replace(one, seed=None),)) or one
        for digits in (0, 1):
            rounder = _rounded(one, digits)
            if rounder != one:
                found = self._first((rounder,))
                if found is not None:
                    return found
        return one


def cut(one: Variation, duration_s: float) -> Variation:
    """The same for a shorter time, without what would come after it."""
    parts = tuple(
        it for it in one.additions if max(it.of("at_s") or 0.0, it.of("from_s") or 0.0) < duration_s
    )
    return replace(one, duration_s=duration_s, additions=parts)


def with_parts(one: Variation, parts: Iterable[Part]) -> Variation:
    """The same with these of its changes alone."""
    kept = list(parts)
    return replace(
        one,
        puts=tuple(it for it in kept if isinstance(it, Put)),
        additions=tuple(it for it in kept if isinstance(it, Addition)),
    )


def _parts_of(one: Variation, quiet: Sequence[Part]) -> tuple[Part, ...]:
    """Its changes without those that take chance out."""
    return (*(put for put in one.puts if put not in quiet), *one.additions)


def _smaller(items: tuple[T, ...]) -> Iterator[tuple[T, ...]]:
    """Parts of it, the smallest first: none, pieces, then all but a piece (delta debugging)."""
    yield ()
    number, size = len(items), len(items)
    while size > 1:
        size = (size + 1) // 2
        pieces = [items[at : at + size] for at in range(0, number, size)]
        yield from (piece for piece in pieces if len(piece) < number)
        if len(pieces) > 2:
            for at in range(0, number, size):
                yield items[:at] + items[at + size :]


def _without_absent(one: Variation) -> Variation:
    """Without changes about robots that do not take part."""
    there = set(one.robots)
    kept = tuple(it for it in one.additions if it.robot is None or it.robot in there)
    return replace(one, additions=kept)


def _rounded(one: Variation, digits: int) -> Variation:
    """With times of that many digits."""

    def rounder(it: Addition) -> Addition:
        for name in ("at_s", "for_s", "from_s", "until_s"):
            value = it.of(name)
            if value is not None and round(value, digits) > 0:
                it = it.with_value(name, round(value, digits))
        return it

    puts = tuple(
        replace(put, value=round(put.value, digits))
        if put.path == ("swarm", "on_s") and round(put.value, digits) > 0
        else put
        for put in one.puts
    )
    return replace(one, puts=puts, additions=tuple(map(rounder, one.additions)))
