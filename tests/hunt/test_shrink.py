"""Shrinking: what is left of a variation that fails."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from kilotwin.studies.hunt.shrink import BATCH, FEW, SHORT_S, Shrinker, Whole, cut
from kilotwin.studies.hunt.variation import Addition, Put, Variation

QUIET = (Put(("medium", "loss"), 0.0), Put(("motion", "motor_noise"), 0.0))
POSES = tuple((float(x), 0.0, 0.0) for x in range(20))
WHOLE = Whole(20, 100.0, POSES, QUIET)


def fault(kind: str, at_s: float, robot: int = 0) -> Addition:
    return Addition(
        ("faults", "robot"), (("kind", kind), ("at_s", at_s)), robot, "robots", listed=True
    )


class Judge:
    """Judges each variation by itself, and counts."""

    def __init__(self, fails: Callable[[Variation], bool]) -> None:
        self._fails = fails
        self.batches: list[int] = []

    def __call__(self, some: Sequence[Variation]) -> list[bool]:
        self.batches.append(len(some))
        return [self._fails(one) for one in some]


def there(one: Variation) -> tuple[int, ...]:
    return one.robots or tuple(range(20))


def shrunk(
    one: Variation, fails: Callable[[Variation], bool], whole: Whole = WHOLE, most: int = 1000
) -> Variation:
    return Shrinker(Judge(fails), whole, most).shrunk(one)


def test_what_always_fails_becomes_one_robot_without_changes_for_a_moment() -> None:
    one = Variation(seed=9, uids=tuple(range(20, 40))).add(
        fault("dead", 3.0), fault("deaf", 5.0, 4)
    )
    least = shrunk(one.put(("swarm", "on_s"), 77.7), lambda _: True)
    assert len(there(least)) == 1
    assert (least.seed, least.uids, least.additions) == (None, (), ())
    assert least.puts == QUIET
    assert least.duration_s is not None
    assert least.duration_s < 1.5
    assert least.poses == POSES


def test_two_robots_that_matter_are_found_among_twenty() -> None:
    least = shrunk(Variation(seed=2), lambda one: {3, 17} <= set(there(one)) and one.seed == 2)
    assert least.robots == (3, 17)
    assert least.seed == 2


def test_the_fault_that_matters_stays_and_others_go() -> None:
    matters = fault("deaf", 12.0, 5)
    one = Variation().add(fault("dead", 1.0), matters, fault("mute", 7.0, 2), fault("stuck", 90.0))
    least = shrunk(one, lambda it: matters in it.additions and 5 in there(it))
    assert least.additions == (matters,)
    assert least.robots == (5,)


def test_time_is_shortened_to_a_tenth_above_what_it_takes() -> None:
    least = shrunk(Variation(), lambda one: (one.duration_s or 100.0) >= 40.0)
    assert least.duration_s is not None
    assert 40.0 <= least.duration_s <= 44.5


def test_chance_that_matters_stays_key_by_key() -> None:
    least = shrunk(Variation(), lambda one: QUIET[1] not in one.puts)
    assert least.puts == QUIET[:1]
    assert shrunk(Variation(), lambda one: not one.puts).puts == ()
    assert shrunk(Variation(), lambda _: True, replace(WHOLE, quiet=())).puts == ()


def test_values_become_round_where_they_may() -> None:
    on = Put(("swarm", "on_s"), 1063.437)
    late = fault("dead", 12.345)
    one = Variation(puts=(on,)).add(late)
    kept = shrunk(
        one, lambda it: len(it.additions) == 1 and any(p.path == on.path for p in it.puts)
    )
    assert kept.additions[0].of("at_s") == 12.0
    assert Put(on.path, 1063.0) in kept.puts
    exact = shrunk(one, lambda it: late in it.additions and on in it.puts)
    assert (exact.additions, exact.puts[0]) == ((late,), on)


def test_a_start_is_kept_where_fixed_poses_do_not_fail() -> None:
    assert shrunk(Variation(), lambda one: not one.poses).poses == ()
    assert shrunk(Variation(), lambda _: True, replace(WHOLE, poses=())).poses == ()
    own = Variation(poses=POSES[::-1])
    assert shrunk(own, lambda one: one.poses == POSES[::-1]).poses == POSES[::-1]


def test_it_ends_when_its_trials_are_spent() -> None:
    judge = Judge(lambda one: len(there(one)) > 5)
    shrinker = Shrinker(judge, WHOLE, 30)
    least = shrinker.shrunk(Variation())
    assert shrinker.tried == sum(judge.batches) == 30
    assert max(judge.batches) <= BATCH
    assert len(there(least)) > 5


def test_what_never_fails_again_stays_as_it_is() -> None:
    one = Variation(seed=4).add(fault("dead", 3.0))
    assert shrunk(one, lambda it: it == one) == one


def test_a_cut_leaves_out_what_comes_after_it() -> None:
    gone = Addition(("faults", "host"), (("from_s", 8.0), ("until_s", 9.0)))
    one = Variation().add(fault("dead", 3.0), fault("deaf", 6.0), gone)
    assert cut(one, 5.0).additions == (fault("dead", 3.0),)
    assert cut(one, 8.5).additions == one.additions


def test_what_comes_by_chance_is_made_to_come_to_few_robots_in_a_short_time() -> None:
    def fails(one: Variation) -> bool:
        is_small = len(there(one)) <= FEW and (one.duration_s or 100.0) <= SHORT_S
        return (one.seed or 0) % 5 == 0 if is_small else one.seed == 9

    least = shrunk(Variation(seed=9), fails)
    assert len(there(least)) <= FEW
    assert least.duration_s is not None
    assert least.duration_s <= SHORT_S


def test_what_comes_late_by_the_clock_is_made_to_come_early() -> None:
    def fails(one: Variation) -> bool:
        on_s = next((put.value for put in one.puts if put.path == ("swarm", "on_s")), 0.0)
        moments = [on_s + (it.of("at_s") or 0.0) for it in one.additions]
        ends_s = on_s + (one.duration_s or 100.0)
        return on_s <= 90 <= ends_s and moments == [80.0] and 5 in there(one)

    one = Variation().add(fault("deaf", 80.0, 5))
    least = shrunk(one, fails, replace(WHOLE, most_on_s=7200.0))
    assert least.duration_s is not None
    assert least.duration_s <= SHORT_S
    assert (shrunk(one, fails).duration_s or 100.0) >= 90
