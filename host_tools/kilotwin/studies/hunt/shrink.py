"""Shrinking: a variation that fails is made as small as it can be and still fails so.

Candidates are tried in batches of fixed size, and the first of a batch that fails is taken: what
comes out does not depend on how many of them run at a time.
"""

import itertools
import math
import random
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from kilotwin.studies.hunt.variation import Addition, Pose, Put, Variation

Fails = Callable[[Sequence[Variation]], Sequence[bool]]
"""Whether each of some variations fails as the one does that is shrunk."""

T = TypeVar("T")
Part = Put | Addition

BATCH = 8
FEW, SHORT_S = 3, 30.0
"""Robots and seconds that a person follows easily: for so few and so short other luck is tried."""
_SMALL_BATCH = 32
_BOTH_TRIES, _EITHER_TRIES = 512, 128
_LEAST_S = 0.5
_MOST_ROUNDS = 6


@dataclass(frozen=True)
class Whole:
    """The experiment before it is shrunk: robots, seconds, the poses with which they began in the
    run that failed, values of keys that take chance out of it, how long robots have been on when it
    begins, and may have been."""

    size: int
    duration_s: float
    poses: tuple[Pose, ...]
    quiet: tuple[Put, ...]
    on_s: float = 0.0
    most_on_s: float = 0.0


Luck = Callable[[random.Random, Variation], Variation]
"""The same with other chance: another seed, other phases."""


def other_seed(chance: random.Random, one: Variation) -> Variation:
    """The least of luck."""
    return replace(one, seed=chance.randrange(1, 2**31))


class Shrinker:
    """Shrinks one variation by trials, `most` of them at most."""

    def __init__(self, fails: Fails, whole: Whole, most: int, luck: Luck = other_seed) -> None:
        self._fails = fails
        self._whole = whole
        self._luck = luck
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
                self._luckier,
                self._quieter,
                self._plainer,
            ):
                one = step(one)
            if one == before or self._left <= 0:
                break
        return one

    def _first(self, candidates: Iterable[Variation], size: int = BATCH) -> Variation | None:
        """The first candidate that fails; they are tried in batches of that size."""
        queue = iter(candidates)
        while self._left > 0:
            batch = list(itertools.islice(queue, min(size, self._left)))
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

    def _luckier(self, one: Variation) -> Variation:
        """With few robots and in a short time by other luck, where that is not so yet: what comes
        by chance comes there too, if enough is tried."""
        there = one.robots or tuple(range(self._whole.size))
        duration_s = one.duration_s or self._whole.duration_s
        few, short = len(there) > FEW, duration_s > SHORT_S
        tries = [(few, short)] * _BOTH_TRIES
        if few and short:
            tries += [(True, False)] * _EITHER_TRIES + [(False, True)] * _EITHER_TRIES
        chance = random.Random(f"luck {len(there)} {duration_s}")
        found = self._first(
            (
                self._smaller_by_luck(chance, one, there if is_few else (), is_short)
                for is_few, is_short in tries
                if is_few or is_short
            ),
            _SMALL_BATCH,
        )
        return found or one

    def _smaller_by_luck(
        self, chance: random.Random, one: Variation, there: tuple[int, ...], is_short: bool
    ) -> Variation:
        """A candidate: with a few of these robots, if there are any, that stand together or not;
        and if it `is_short` with its last seconds or its first."""
        if there:
            robots = chance.sample(there, FEW)
            if one.poses and chance.random() < 0.5:
                x, y, _ = one.poses[robots[0]]
                near = sorted(
                    there, key=lambda at: math.hypot(one.poses[at][0] - x, one.poses[at][1] - y)
                )
                robots = near[:FEW]
            one = _without_absent(replace(one, robots=tuple(sorted(robots))))
            if not is_short:
                # Seldom events among few robots need their time.
                one = replace(one, duration_s=min(SHORT_S, self._whole.duration_s))
        if is_short:
            later_s = (one.duration_s or self._whole.duration_s) - SHORT_S
            if chance.random() < 0.5:
                one = self._later(one, later_s)
            one = cut(one, SHORT_S)
        return self._luck(chance, one)

    def _later(self, one: Variation, by_s: float) -> Variation:
        """The same from a later time on: robots have been on for longer, and what happens in the
        run comes so much earlier. As it is if they may not."""
        on = [put.value for put in one.puts if put.path == _ON_S]
        on_s = round((on[0] if on else self._whole.on_s) + by_s, 3)
        if on_s > self._whole.most_on_s:
            return one
        parts = tuple(kept for it in one.additions if (kept := _earlier(it, by_s)) is not None)
        return replace(one, additions=parts).put(_ON_S, on_s)

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


_ON_S = ("swarm", "on_s")


def _earlier(it: Addition, by_s: float) -> Addition | None:
    """The same, so much earlier; None if it would be over before the run."""
    for name in ("at_s", "from_s", "until_s"):
        value = it.of(name)
        if value is not None:
            for_s = it.of("for_s") or 0.0
            if value + for_s < by_s or (for_s == 0.0 and value < by_s):
                return None
            it = it.with_value(name, max(0.0, round(value - by_s, 3)))
    return it


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
