"""Checks of many start poses: the sieves before them let nothing through that is wrong."""

import itertools
import math

import numpy as np
import pytest

from kilotwin.experiment.checks.arena import in_doubt, pose_problems
from kilotwin.experiment.checks.crowds import crowded
from kilotwin.experiment.checks.experiment import first_problem
from kilotwin.experiment.schema.experiment import ExperimentSchema

ROBOT_M = 0.033


def experiment(**more: object) -> ExperimentSchema:
    swarm = {"profile": "kilobot"}
    return ExperimentSchema.model_validate({"name": "n", "duration_s": 1.0, "swarm": swarm, **more})


@pytest.mark.parametrize("seed", range(20))
def test_of_places_all_that_are_near_one_another_are_found_and_no_others(seed: int) -> None:
    chance = np.random.default_rng(seed)
    places = chance.uniform(-0.5, 0.5, (60 + 10 * seed, 2)) * (0.3 + seed, 1.0)
    found = crowded(places, ROBOT_M)
    near = {
        index
        for pair in itertools.combinations(range(len(places)), 2)
        if math.dist(places[pair[0]], places[pair[1]]) < ROBOT_M
        for index in pair
    }
    squares = np.unique(np.floor(places / ROBOT_M), axis=0, return_counts=True)[1]
    assert set(np.flatnonzero(found)) == (near if squares.max() <= 4 else set(range(len(places))))


def test_where_more_are_in_a_square_than_fit_all_places_are_looked_at() -> None:
    places = np.vstack([np.full((5, 2), 0.01), np.array([[1.0, 1.0]])])
    assert crowded(places, ROBOT_M).all()
    assert not crowded(places[4:], ROBOT_M).any()


@pytest.mark.parametrize("count", [0, 1])
def test_few_places_are_no_crowd(count: int) -> None:
    assert not crowded(np.zeros((count, 2)), ROBOT_M).any()


_POLYGON = [[-0.5, -0.5], [0.5, -0.5], [0.0, 0.5]]


@pytest.mark.parametrize(
    ("arena", "some_are_clear"),
    [
        ({"shape": "circle", "diameter_m": 1.0}, True),
        ({"shape": "rectangle", "width_m": 1.0, "height_m": 0.6}, True),
        ({"shape": "polygon", "points_m": _POLYGON}, False),
        ({"shape": "circle", "diameter_m": 0.02}, False),
        ({"shape": "rectangle", "width_m": 0.02, "height_m": 1.0}, False),
    ],
)
def test_a_pose_that_is_wrong_is_in_doubt(arena: dict[str, object], some_are_clear: bool) -> None:
    obstacles = [
        {"shape": "circle", "diameter_m": 0.2, "centre_m": [0.1, 0.1]},
        {"shape": "rectangle", "width_m": 0.2, "height_m": 0.1, "heading_rad": 0.7},
        {"shape": "polygon", "points_m": [[0.2, 0.0], [0.3, 0.0], [0.3, 0.2]]},
    ]
    keys = experiment(arena=arena, obstacle=obstacles)
    places = np.random.default_rng(1).uniform(-0.6, 0.6, (500, 2))
    doubtful = in_doubt(places, ROBOT_M / 2, keys)
    wrong = [any(pose_problems((), x, y, ROBOT_M / 2, keys)) for x, y in places.tolist()]
    assert sum(wrong) > 50
    assert not (np.array(wrong) & ~doubtful).any()
    assert (~doubtful).any() == some_are_clear


def test_of_many_poses_the_first_that_is_wrong_is_named() -> None:
    grid = [[x / 10, y / 10, 0.0] for x in range(-20, 21) for y in range(-20, 21)]
    arena = {"shape": "rectangle", "width_m": 6.0, "height_m": 6.0}
    kinds = [
        {"program": "a.c", "count": len(grid), "poses": grid},
        {"program": "a.c", "count": 2, "poses": [[2.5, 0.0, 0.0], [0.31, 0.2, 0.0]]},
    ]
    problem = first_problem(experiment(arena=arena, robots=kinds), lambda _: False)
    assert problem is not None
    beside = 41 * 23 + 22  # the robot at (0.3, 0.2)
    assert problem.paths == (("robots", 1, "poses", 1), ("robots", 0, "poses", beside))
    kinds[1]["poses"] = [[2.5, 0.0, 0.0], [0.31, 3.2, 0.0]]
    problem = first_problem(experiment(arena=arena, robots=kinds), lambda _: False)
    assert problem is not None
    assert problem.what == "a robot at (0.31, 3.2) m does not stand inside the arena; move it"
