"""Which checkpoints of a run are kept."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from kilotwin.session.debug.checkpoints import Checkpoint, latest, least_needed, on_the_way


def kept_of(ticks: int, most: int) -> list[int]:
    kept: list[int] = []
    for tick in range(ticks):
        if len(kept) == most:
            kept.pop(least_needed(kept, tick))
        kept.append(tick)
    return kept


def test_checkpoints_are_close_near_the_present_and_far_apart_behind_it() -> None:
    kept = kept_of(3000, 20)
    gaps = [after - before for before, after in pairwise(kept)]
    assert kept[0] == 0
    assert kept[-1] == 2999
    assert max(gaps[-5:]) < 30
    assert max(gaps[:5]) > 200


@given(st.lists(st.integers(0, 1 << 20), min_size=3, max_size=30, unique=True), st.integers(0, 999))
def test_the_first_and_the_last_stay(ticks: list[int], now: int) -> None:
    assert 0 < least_needed(sorted(ticks), now) < len(ticks) - 1


def test_the_latest_checkpoint_is_the_last_one_that_is_not_behind_the_tick() -> None:
    checkpoints = [Checkpoint(tick, slot, 1) for slot, tick in enumerate((-5, 10, 20))]
    assert latest(checkpoints, 19) == checkpoints[1]
    assert latest(checkpoints, 20) == checkpoints[2]
    assert latest(checkpoints, -6) is None


def test_on_the_way_to_a_moment_each_checkpoint_is_half_as_far_from_it() -> None:
    assert on_the_way(0, 16) == [8, 12, 14]
    assert on_the_way(7, 10) == []
