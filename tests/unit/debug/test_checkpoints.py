"""Which checkpoints of a run are kept."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from kilotwin.session.debug.checkpoints import (
    Checkpoint,
    Written,
    latest,
    least_needed,
    on_the_way,
)


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


def written() -> Written:
    """Of three stretches of 100 ticks; in the second the byte 0x150 has changed."""
    out = Written(3, -8)
    out.add(-8, 100, [0x120])
    out.add(100, 200, [0x120, 0x150])
    out.add(200, 300, [0x120])
    out.add(300, 400, [0x120])
    out.add(400, 500, [0x120])
    return out


def test_what_has_not_changed_there_nor_beside_it_needs_no_look() -> None:
    looks = [written().may_be_in(begin, begin + 100, 0x150, 1) for begin in (0, 100, 200, 300)]
    assert looks == [True, True, True, False]
    assert written().may_be_in(300, 400, 0x120, 1)
    assert written().may_be_in(300, 400, 0x11F, 2)
    assert not written().may_be_in(300, 400, 0x11E, 2)
    assert not written().may_be_in(320, 330, 0x150, 1)


def test_of_what_is_not_known_it_may_have_changed() -> None:
    assert written().may_be_in(400, 500, 0x150, 1)  # nothing is known of what comes behind
    assert written().may_be_in(450, 600, 0x150, 1)
    assert written().may_be_in(-20, 10, 0x130, 1)
    assert written().may_be_in(300, 400, 0x20, 1)  # a register
    assert Written(3, 0).may_be_in(0, 100, 0x150, 1)


def test_a_stretch_that_was_repeated_adds_what_is_new_of_it() -> None:
    known = written()
    known.add(200, 300, [0x160])
    known.add(600, 700, [0x160])
    assert known.ends[-1] == 500
    known.add(300, 600, [0x170])
    known.add(600, 700, [])
    known.add(700, 800, [])
    assert known.ends[-3:] == [600, 700, 800]
    assert not known.may_be_in(300, 400, 0x170, 1)
    assert known.may_be_in(600, 700, 0x170, 1)
