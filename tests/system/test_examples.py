"""The programs of firmware/examples do what they say, on the medium and motion of real robots."""

import math
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kilotwin import RGB, World

EXAMPLES = Path(__file__).parents[2] / "firmware" / "examples"
TICK_S = 0.032768
OFF, RED, GREEN, BLUE = RGB(0, 0, 0), RGB(3, 0, 0), RGB(0, 3, 0), RGB(0, 0, 3)
WHITE, YELLOW = RGB(3, 3, 3), RGB(3, 3, 0)

Pose = tuple[float, float, float]


def world_of(name: str, poses: Sequence[Pose], seed: int = 1, **keys: Any) -> World:
    # Looked at every two ticks, finer than a Kilobot's world steps by default.
    keys.setdefault("engine", {"step_ticks": 2})
    return World(program=EXAMPLES / f"{name}.c", poses=poses, seed=seed, **keys)


def in_line(count: int, gap_m: float) -> list[Pose]:
    return [(gap_m * (i - (count - 1) / 2), 0.0, 0.0) for i in range(count)]


def changes(world: World, of_s: float, every_ticks: int = 2) -> list[tuple[int, int]]:
    """Robot 0's colours as (tick at which it was first seen, colour)."""
    seen: list[tuple[int, int]] = []
    while world.time_s < of_s:
        colour = int(world.leds[0])
        if not seen or seen[-1][1] != colour:
            seen.append((world.tick, colour))
        world.run_ticks(every_ticks)
    return seen


def test_blink_is_red_and_off_for_half_a_second_each() -> None:
    with world_of("blink", [(0, 0, 0)], medium={"clock_spread": 0}) as world:
        seen = changes(world, 20)
    assert {colour for _, colour in seen} == {RED, OFF}
    lengths = np.diff([tick for tick, _ in seen[1:]])
    assert len(lengths) >= 36
    assert set(lengths) <= {14, 16}  # 15 ticks, seen every second one
    assert lengths.mean() == pytest.approx(15, abs=0.1)


def test_move_goes_straight_left_right_and_rests() -> None:
    with world_of("move", [(0, 0, 0)], medium={"clock_spread": 0}) as world:
        running = {GREEN: [True, True], RED: [True, False], BLUE: [False, True], OFF: [False] * 2}
        seen: list[tuple[int, int]] = []
        while not world.motors.any():
            world.run_ticks(1)  # it sees RUN when its blink is over
        while world.time_s < 18.5:
            colour = int(world.leds[0])
            if not seen or seen[-1][1] != colour:
                seen.append((world.tick, colour))
            else:
                assert (world.motors[0] > 0).tolist() == running[colour]
            world.run_ticks(2)
    assert [colour for _, colour in seen[:8]] == [GREEN, RED, BLUE, OFF] * 2
    ticks = np.diff([tick for tick, _ in seen[:9]])
    assert ticks == pytest.approx([124, 62, 62, 31] * 2, abs=3)


def test_talk_and_listen_is_red_alone_and_green_with_company() -> None:
    for poses, expected in [(in_line(1, 0), RED), (in_line(2, 0.05), GREEN)]:
        with world_of("talk_and_listen", poses) as world:
            world.run(3)
            shown = [int(world.leds[0])]
            for _ in range(100):
                world.run_ticks(2)
                shown.append(int(world.leds[0]))
        # Blue for 3 ticks of the 16 from one message to the next.
        assert set(shown) == {expected, BLUE}
        assert 0.1 < shown.count(BLUE) / len(shown) < 0.3


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_orbit_keeps_its_distance_on_its_way_round(seed: int) -> None:
    poses = [(0.0, 0.0, 0.0), (0.06, 0.0, math.pi / 2)]
    with world_of("orbit", poses, seed) as world:
        world.run(30)
        distances, angles, greens = [], [], 0
        for _ in range(600):
            world.run(0.5)
            (x0, y0, _), (x, y, _) = world.poses
            distances.append(1000 * math.hypot(x - x0, y - y0))
            angles.append(math.atan2(y - y0, x - x0))
            greens += int(world.leds[1]) == GREEN
        assert int(world.leds[0]) == WHITE
    # It promises 60 mm, within 10 mm of which it is green.
    assert min(distances) > 50
    assert max(distances) < 70
    assert 57 < np.mean(distances) < 66
    assert greens > 570
    # With the planet on its left it goes round counter-clockwise.
    assert np.unwrap(angles)[-1] - angles[0] > 2 * math.pi


def hops_from_first(poses: Sequence[Pose], range_m: float) -> list[int]:
    """By breadth-first search over the robots in range of one another."""
    hops = {0: 0}
    queue = deque([0])
    while queue:
        here = queue.popleft()
        for other, (x, y, _) in enumerate(poses):
            near = math.hypot(x - poses[here][0], y - poses[here][1]) <= range_m
            if near and other not in hops:
                hops[other] = hops[here] + 1
                queue.append(other)
    return [hops[robot] for robot in range(len(poses))]


@pytest.mark.parametrize("seed", [1, 2])
def test_gradient_is_the_number_of_hops(seed: int) -> None:
    random = np.random.default_rng(seed)
    spots = [(0.07 * i, 0.07 * j) for i in range(6) for j in range(4)]
    poses: list[Pose] = [
        (x + shift[0] - 0.2, y + shift[1] - 0.1, 0.0)
        for (x, y), shift in zip(spots, random.uniform(-0.015, 0.015, (24, 2)), strict=True)
    ]
    expected = hops_from_first(poses, 0.1)
    assert max(expected) >= 4
    medium = {"range_spread": 0, "loss": 0, "loss_at_range": 0}
    with world_of("gradient", poses, seed, medium=medium) as world:
        world.run(60)
        assert [world.variable(robot, "hops") for robot in range(24)] == expected
        colours = [WHITE, RED, GREEN, BLUE, YELLOW, RGB(3, 0, 3), RGB(0, 3, 3), RED]
        assert world.leds.tolist() == [colours[hops] for hops in expected]


@pytest.mark.parametrize("seed", [1, 2])
def test_flashes_end_in_step(seed: int) -> None:
    with world_of("flash_sync", in_line(9, 0.06), seed) as world:
        world.run(60)
        begins: list[list[int]] = [[] for _ in range(9)]
        was = world.leds
        for _ in range(100):
            world.run_ticks(2)
            now = world.leds
            for robot in np.flatnonzero((now == WHITE) & (was != WHITE)):
                begins[robot].append(world.tick)
            was = now
    # 200 ticks hold three flashes of all. A clock is up to a tick and a message's way behind the
    # one it follows, hop by hop; four hops and the two ticks between looks make up to ten.
    rounds = min(map(len, begins))
    assert rounds >= 2
    last = [robot[-1] for robot in begins]
    spread = (np.array(last) - last[4] + 32) % 64 - 32
    assert np.ptp(spread) <= 10


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_phototaxis_ends_at_the_light(seed: int) -> None:
    source = {"at_m": [0.2, 0.1], "peak": 900, "half_m": 0.25}
    keys = {"light": {"ambient": 50, "source": [source]}}
    with world_of("phototaxis", [(-0.2, -0.1, 1.0)], seed, **keys) as world:

        def away_m() -> float:
            x, y, _ = world.poses[0]
            return math.hypot(x - 0.2, y - 0.1)

        began = away_m()
        world.run(400)
        ends = []
        for _ in range(60):
            world.run(1)
            ends.append(away_m())
    assert began > 0.4
    assert max(ends) < 0.1


@pytest.mark.parametrize("neighbours", [0, 1, 2, 3, 5])
def test_random_walk_counter_shows_how_many_are_there(neighbours: int) -> None:
    places = [(0.05, 0.0), (-0.05, 0.0), (0.0, 0.05), (0.0, -0.05), (0.04, 0.04)]
    poses = [(0.0, 0.0, 0.0), *((x, y, 0.0) for x, y in places[:neighbours])]
    medium = {"range_m": 0.4, "range_spread": 0, "loss": 0, "loss_at_range": 0}
    shown = []
    with world_of("random_walk_counter", poses, medium=medium, arena=(0.3, 0.3)) as world:
        world.run(3)
        for _ in range(40):
            world.run(1)
            shown.append(int(world.leds[0]))
        x, y, _ = world.poses[0]
        assert math.hypot(x, y) > 0.01
    expected = [OFF, RED, YELLOW, GREEN, BLUE][min(neighbours, 4)]
    # A second holds 1.9 messages of each; now and then one is missed.
    assert shown.count(expected) >= 32
