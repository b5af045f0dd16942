"""Moves: what a hunt may change, and that it stays within [hunt]."""

import math
import random
from dataclasses import replace

import pytest

from kilotwin.experiment.schema.hunt import Hunt
from kilotwin.studies.hunt.moves import Ground, fresh, mutated
from kilotwin.studies.hunt.variation import LATE, Variation

ROW = tuple((0.1 * x, 0.0, 0.0) for x in range(5))
GROUND = Ground(
    hunt=Hunt(),
    size=5,
    duration_s=60.0,
    box=(-0.5, -0.5, 0.5, 0.5),
    has_room=lambda x, y: math.hypot(x, y) < 0.48,
    radius_m=0.0165,
    range_m=0.1,
    poses=None,
    fixed_uids=False,
    has_commands=False,
    has_pulses=True,
    drifts=True,
    ambient=50.0,
    modules=None,
    battery_h=0.0,
)
GRID = replace(GROUND, modules=(4, 3), has_commands=True)


def often(ground: Ground, name: str, times: int = 200) -> list[Variation]:
    chance, move = random.Random(1), ground.moves()[name]
    one, found = Variation(), []
    for _ in range(times):
        one = move(chance, one)
        found.append(one)
    return found


def test_all_moves_are_allowed_by_default_and_those_of_a_grid_on_one() -> None:
    plain, grid = set(GROUND.moves()), set(GRID.moves())
    assert grid - plain == {"modules reset", "CAN errors", "host gone"}
    assert plain - grid == {"RUN late", "resets"}


def test_a_hunt_of_zeros_varies_seeds_alone() -> None:
    off = {
        name: type(value)(0)
        for name, value in Hunt().model_dump().items()
        if name not in ("spell_s", "mistakes", "undefined")
    }
    assert set(replace(GRID, hunt=Hunt(**off)).moves()) == {"seed"}


@pytest.mark.parametrize(
    ("differs", "gone"),
    [
        ({"fixed_uids": True}, {"uids"}),
        ({"has_pulses": False}, {"oscillators", "losses"}),
        ({"battery_h": 2.0}, {"batteries"}),
        (
            {"duration_s": 0.5},
            {"deaf or mute for a while", "resets", "robots moved"},
        ),
    ],
)
def test_what_an_experiment_does_not_have_is_not_varied(
    differs: dict[str, float], gone: set[str]
) -> None:
    assert set(GROUND.moves()) - set(replace(GROUND, **differs).moves()) == gone  # type: ignore[arg-type]


def test_crowds_stand_inside_and_clear_of_one_another() -> None:
    crowds = [one for one in often(GROUND, "starts", 50) if one.poses]
    assert len(crowds) > 40
    for one in crowds:
        for x, y, turn in one.poses:
            assert math.hypot(x, y) < 0.48
            assert abs(turn) <= math.pi
        for index, (x, y, _) in enumerate(one.poses):
            for a, b, _ in one.poses[:index]:
                assert math.hypot(x - a, y - b) >= 2 * GROUND.radius_m


def test_a_robot_is_moved_to_where_there_is_room_or_not_at_all() -> None:
    for one in often(GROUND, "robots moved"):
        x, y, _ = one.additions[-1].of("pose")
        assert math.hypot(x, y) < 0.48
    full = replace(GROUND, has_room=lambda _x, _y: False)
    assert often(full, "robots moved", 3)[-1] == Variation()


def test_a_crowd_that_finds_no_room_is_left_out() -> None:
    tight = replace(GROUND, size=400, box=(-0.1, -0.1, 0.1, 0.1))
    assert often(tight, "starts", 1)[0].poses == ()


def test_robots_with_poses_are_nudged_and_turned() -> None:
    for one in often(replace(GROUND, poses=ROW), "starts", 20):
        assert one.poses
        for (x, y, _), (a, b, _) in zip(one.poses, ROW, strict=True):
            assert max(abs(x - a), abs(y - b)) <= 0.0031


def test_uids_are_all_different_and_odd_ones_come_up() -> None:
    seen = set()
    for one in often(GROUND, "uids"):
        assert len(set(one.uids)) == 5
        seen |= set(one.uids)
    assert {0, 255, 65_535} <= seen
    assert max(seen) <= 65_535


def test_clocks_often_begin_shortly_before_a_number_wraps() -> None:
    starts = [one.puts[0].value for one in often(GROUND, "clocks at the start")]
    assert all(0 <= on_s <= 7200 for on_s in starts)
    assert sum(1063 < on_s < 1074 for on_s in starts) > 10
    short = often(replace(GROUND, hunt=Hunt(on_s=5.0)), "clocks at the start")
    assert all(one.puts[0].value <= 5.0 for one in short)


def test_additions_stay_as_many_as_are_allowed() -> None:
    last = often(GROUND, "deaf or mute for a while")[-1]
    assert len(last.additions) == 2
    assert len(often(GROUND, "robots that fail")[-1].additions) == 1
    assert len(often(GROUND, "robots moved")[-1].additions) == 2
    assert len(often(GROUND, "light")[-1].additions) == 2
    assert len(often(GROUND, "resets")[-1].additions) == 2
    assert len(often(replace(GROUND, hunt=Hunt(resets=2)), "resets")[-1].additions) == 4
    assert len(often(GRID, "modules reset")[-1].additions) == 1
    assert len(often(GRID, "host gone")[-1].additions) == 1


def test_all_kinds_of_faults_come_up_and_foot_bots_do_not_drift() -> None:
    kinds = {one.additions[-1].of("kind") for one in often(GROUND, "robots that fail")}
    assert kinds == {"dead", "stuck", "deaf", "mute", "drift"}
    no_drift = often(replace(GROUND, drifts=False), "robots that fail")
    assert {one.additions[-1].of("kind") for one in no_drift} == {"dead", "stuck", "deaf", "mute"}


def test_values_stay_within_what_is_allowed() -> None:
    for one in often(GROUND, "losses"):
        near, far = (put.value for put in one.puts)
        assert 0 <= near <= far <= 0.4
    assert all(one.puts[0].value <= 0.02 for one in often(GROUND, "oscillators"))
    assert all(-50 <= one.additions[-1].of("ambient") <= 150 for one in often(GROUND, "light"))
    assert all(0 < one.puts[0].value <= 0.1 for one in often(GROUND, "batteries"))
    assert all(0 <= one.puts[0].value <= 0.02 for one in often(GRID, "CAN errors"))
    for one in often(GROUND, "RUN late"):
        assert all(it.path == LATE and 0 <= it.of("at_s") <= 2.0 for it in one.additions)
        robots = [it.robot for it in one.additions]
        assert robots == sorted(set(robots))  # type: ignore[type-var]
    for one in often(GROUND, "resets"):
        reset, run = one.additions
        assert 0 <= reset.of("at_s") < run.of("at_s") < 60


def test_a_reset_leaves_what_else_is_varied() -> None:
    chance, moves = random.Random(3), GROUND.moves()
    one = moves["resets"](chance, moves["light"](chance, Variation()))
    assert [it.path for it in one.additions] == [("step",), ("command",), ("command",)]


def test_the_same_chance_plans_the_same() -> None:
    moves = GROUND.moves()
    assert fresh(random.Random(5), moves) == fresh(random.Random(5), moves)


def test_a_variation_near_another_takes_over_drops_or_adds() -> None:
    moves, chance = GROUND.moves(), random.Random(7)
    one = moves["uids"](chance, Variation(seed=1)).put(("medium", "loss"), 0.3)
    other = moves["light"](chance, Variation(seed=2)).put(("swarm", "on_s"), 9.0)
    near = [mutated(chance, moves, one, other) for _ in range(300)]
    assert any(put.path == ("swarm", "on_s") and put.value == 9.0 for it in near for put in it.puts)
    assert any(not it.puts for it in near)
    assert any(it.seed == 1 for it in near)
    assert mutated(chance, moves, Variation(seed=3), Variation(seed=4)) != Variation(seed=3)


def test_clocks_uids_and_moments_are_often_about_constants_of_the_program() -> None:
    ground = replace(GROUND, constants=(3, 700, 40_000))
    clocks = [it.puts[0].value * 30.517578125 for it in often(ground, "clocks at the start")]
    uids = [it.uids[0] for it in often(ground, "uids")]
    spells = [it.additions[-1] for it in often(ground, "deaf or mute for a while")]
    near = [700 / 30.517578125 - at for at in (it.of("at_s") for it in spells) if at is not None]
    assert sum(39_600 < at < 40_000 for at in clocks) > 20
    assert sum(abs(uid - 700) <= 1 for uid in uids) > 5
    assert sum(abs(at) <= 2 for at in near) > 40
