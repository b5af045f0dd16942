"""Robots of a formation start as its shape says: apart, about its middle, by the seed."""

import math
import random
from itertools import combinations

import numpy as np
import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.formations import pitch_of, poses_of
from kilotwin.experiment.schema.start import Formation

from ..conftest import Load

DIAMETER = 0.033
SWARM = """
duration_s = 1
seed = {seed}
[arena]
diameter_m = 2
[swarm]
profile = "kilobot"
[[robots]]
program = "blink.c"
count = {count}
{more}
"""


def poses(count: int, seed: int = 1, **keys: object) -> "np.ndarray[tuple[int, int], np.dtype]":
    formation = Formation.model_validate(keys)
    found = poses_of(formation, count, DIAMETER, random.Random(seed).random)
    assert found is not None
    return np.array(found)


@pytest.mark.parametrize("count", [1, 2, 7, 19, 50])
@pytest.mark.parametrize("shape", ["line", "grid", "hexagon", "ring", "disc", "pile"])
def test_each_shape_keeps_robots_apart_and_about_its_middle(shape: str, count: int) -> None:
    found = poses(count, shape=shape, centre_m=[0.3, -0.2])
    assert found.shape == (count, 3)
    near = [math.dist(a, b) for a, b in combinations(found[:, :2], 2)]
    least = DIAMETER if shape in ("disc", "pile") else pitch_of(Formation(shape=shape), DIAMETER)  # type: ignore[arg-type]
    assert min(near, default=1) >= least - 1e-9
    assert math.dist(found[:, :2].mean(axis=0), (0.3, -0.2)) < 3 * DIAMETER
    assert (np.abs(found[:, 2]) <= math.pi).all()


def test_a_line_is_along_x_and_turns_about_its_middle() -> None:
    straight = poses(3, shape="line", pitch_m=0.1, heading_rad=0.5)
    assert straight == pytest.approx(np.array([[-0.1, 0, 0.5], [0, 0, 0.5], [0.1, 0, 0.5]]))
    turned = poses(3, shape="line", pitch_m=0.1, heading_rad=0.5, turn_rad=math.pi / 2)
    assert turned == pytest.approx(np.array([[0, -0.1, 0.5], [0, 0, 0.5], [0, 0.1, 0.5]]))


def test_a_grid_has_its_columns_and_begins_at_the_lower_left() -> None:
    found = poses(5, shape="grid", columns=3, pitch_m=0.1)
    wanted = [[-0.1, -0.05], [0, -0.05], [0.1, -0.05], [-0.1, 0.05], [0, 0.05]]
    assert found[:, :2] == pytest.approx(np.array(wanted))
    assert len(poses(2, shape="grid", columns=9)) == 2


def test_a_hexagon_s_first_seven_are_all_a_pitch_from_the_middle() -> None:
    found = poses(7, shape="hexagon", pitch_m=0.05)[:, :2]
    away = np.hypot(*found.T)
    assert away == pytest.approx([0, *[0.05] * 6])
    assert math.dist(found[1], found[2]) == pytest.approx(0.05)


def test_neighbours_on_a_ring_are_a_pitch_apart() -> None:
    found = poses(10, shape="ring", pitch_m=0.05)[:, :2]
    assert [math.dist(found[i], found[i - 1]) for i in range(10)] == pytest.approx([0.05] * 10)


def test_a_disc_is_filled_evenly_to_its_border() -> None:
    """The mean distance from the middle of 400 robots is 2/3 of the radius, within 5 standard
    deviations of 0.236 of the radius."""
    found = poses(400, shape="disc", pitch_m=0.1)[:, :2]
    radius = 0.1 * math.sqrt(400 / math.pi)
    away = np.hypot(*found.T) / radius
    assert away.max() <= 1
    assert away.mean() == pytest.approx(2 / 3, abs=5 * 0.236 / math.sqrt(400))


def test_the_seed_alone_draws_places_and_headings(load: Load) -> None:
    def starts(seed: int, more: str = 'formation = { shape = "pile" }') -> list[list[float]]:
        found = load(SWARM.format(seed=seed, count=5, more=more)).groups[0].poses
        assert found is not None
        return found

    assert starts(1) == starts(1) != starts(2)
    still = 'formation = { shape = "line", heading_rad = 0 }'
    assert starts(1, still) == starts(2, still)


def test_the_resolved_experiment_keeps_the_formation(load: Load) -> None:
    experiment = load(SWARM.format(seed=1, count=5, more='formation = { shape = "disc" }'))
    again = load(experiment.to_toml())
    assert again.groups[0].poses == experiment.groups[0].poses
    assert again.identity() == experiment.identity()
    assert "poses" not in experiment.to_toml()


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('formation = { shape = "star" }', 'formation.shape is "star"; .*line, grid, hexagon'),
        ('formation = { shape = "line", pitch_m = 0.02 }', "11: pitch_m is 0.02; a robot is 0.033"),
        (
            'formation = { shape = "line" }\nposes = [[0, 0, 0]]',
            "11: these robots have poses too; keep one of them",
        ),
        ('formation = { shape = "line", pitch_m = 3 }', "does not stand inside the arena"),
        (
            'formation = { shape = "disc", pitch_m = 0.034 }',
            "11: 40 robots find no room in that disc; make pitch_m more than 0.034",
        ),
        ('columns = { x = "a", y = "b" }', "11: columns are of a file"),
    ],
)
def test_a_formation_that_cannot_be_says_why(more: str, said: str, load: Load) -> None:
    with pytest.raises(InputError, match=said):
        load(SWARM.format(seed=1, count=40, more=more))


@pytest.mark.parametrize(
    ("swarm", "kinds", "uids"),
    [
        ("first_uid = 0", ["count = 2", "count = 1"], [0, 1, 2]),
        ("", ["count = 2\nuids = [7, 0]", "count = 1"], [7, 0, 3]),
        ("", ["count = 2", "count = 2\nfirst_uid = 10"], [1, 2, 10, 11]),
        ("first_uid = 5", ["count = 1\nuids = [0]", "count = 2"], [0, 6, 7]),
        ("", ["count = 2"], [1, 2]),
    ],
)
def test_robots_have_the_uids_that_the_file_says(
    swarm: str, kinds: list[str], uids: list[int], load: Load
) -> None:
    experiment = _with_uids(swarm, kinds, load)
    assert [experiment.uid_of(index) for index in range(experiment.size)] == uids


@pytest.mark.parametrize(
    ("swarm", "kinds", "said"),
    [
        ("", ["count = 2\nuids = [1]"], "1 uids for 2 robots"),
        ("", ["count = 1\nuids = [1]\nfirst_uid = 1"], "have first_uid too"),
        ("", ["count = 1", "count = 1\nuids = [1]"], "two robots have the uid 1"),
        ("", ["count = 2\nfirst_uid = 65535"], "would have the uid 65536"),
        ("", ["count = 1\nuids = [70000]"], "uids.0 is 70000; it must be from 0 up to 65535"),
    ],
)
def test_uids_that_cannot_be_are_refused(
    swarm: str, kinds: list[str], said: str, load: Load
) -> None:
    with pytest.raises(InputError, match=said):
        _with_uids(swarm, kinds, load)


def _with_uids(swarm: str, kinds: list[str], load: Load) -> Experiment:
    tables = "".join(f'[[robots]]\nprogram = "blink.c"\n{kind}\n' for kind in kinds)
    head = 'duration_s = 1\n[arena]\ndiameter_m = 1\n[swarm]\nprofile = "kilobot"\n'
    return load(f"{head}{swarm}\n{tables}")


def test_keys_name_robots_by_these_uids(load: Load) -> None:
    head = 'duration_s = 9\n[arena]\ndiameter_m = 1\n[swarm]\nprofile = "kilobot"\n'
    kind = '[[robots]]\nprogram = "blink.c"\ncount = 2\nuids = [0, 9]\n'
    command = '[[command]]\nat_s = 1\nsend = "run"\nrobot = {}\n'
    step = "[[step]]\nat_s = 1\nrobot = {}\npose = [0, 0, 0]\n"
    for table in (command, step):
        assert load(f"{head}{kind}{table.format(0)}").robot_of(9) == 1
        with pytest.raises(InputError, match="there is no robot 1; the robots are 0 and 9"):
            load(f"{head}{kind}{table.format(1)}")
