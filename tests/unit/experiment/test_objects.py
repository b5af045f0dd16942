"""The engine's tables of [[object]]s, and where their parts lie."""

import math

import pytest

from kilotwin.experiment import polygons
from kilotwin.experiment.areas import disc, overlap
from kilotwin.experiment.schema.object import PushedObject
from kilotwin.experiment.spec.objects import areas_at, object_spec, parts_of

from ..conftest import Load
from .test_kilobot_profile import KILOBOT, spec_of

TEE = """
[[object]]
shape = "joined"
pose = [0.5, 0.0, 1.5707963267948966]
mass_kg = 0.004
friction = 0.2

[[object.part]]
diameter_m = 0.1
centre_m = [0.2, 0.0]

[[object.part]]
shape = "rectangle"
width_m = 0.3
height_m = 0.02
heading_rad = 1.5707963267948966
"""


def test_the_engine_is_told_parts_friction_and_the_beacon(load: Load) -> None:
    beacon = "\n[object.beacon]\ntype = 3\ndata = [1, 2]\nperiod_s = 1.0\n"
    objects = spec_of(load(KILOBOT + TEE + beacon))["objects"]
    assert isinstance(objects, list)
    (told,) = objects
    assert told["pose"] == [0.5, 0.0, math.pi / 2]
    assert (told["mass_kg"], told["friction"], told["turning_friction"]) == (0.004, 0.2, 0.2)
    assert told["robot_friction"] == 0.3
    assert told["beacon"] == {"message": bytes([1, 2, 0, 0, 0, 0, 0, 0, 0, 3]), "period_ticks": 31}
    round_part, bar = told["parts"]
    assert round_part == {"centre_m": [0.2, 0.0], "radius_m": 0.05, "corners_m": []}
    assert bar["radius_m"] == 0.0
    corners = [(-0.01, -0.15), (-0.01, 0.15), (0.01, -0.15), (0.01, 0.15)]
    found = sorted((round(x, 9), round(y, 9)) for x, y in bar["corners_m"])
    assert found == corners


def test_without_objects_there_are_none(load: Load) -> None:
    assert spec_of(load(KILOBOT))["objects"] == []


def test_friction_against_turning_can_be_its_own() -> None:
    thing = PushedObject(diameter_m=0.1, mass_kg=1.0, friction=0.5, turning_friction=0.1)
    assert (object_spec(thing)["friction"], object_spec(thing)["turning_friction"]) == (0.5, 0.1)
    assert object_spec(thing)["beacon"] is None


def test_a_concave_polygon_becomes_convex_pieces_of_the_same_area() -> None:
    ell = [[0.0, 0.0], [0.3, 0.0], [0.3, 0.1], [0.1, 0.1], [0.1, 0.3], [0.0, 0.3]]
    thing = PushedObject(shape="polygon", points_m=ell, mass_kg=1.0)
    pieces = object_spec(thing)["parts"]
    assert len(pieces) == 2
    areas = [
        sum(a[0] * b[1] - a[1] * b[0] for a, b in polygons.edges(piece["corners_m"])) / 2
        for piece in pieces
    ]
    assert min(areas) > 0  # counter-clockwise
    assert math.fsum(areas) == pytest.approx(0.05)


def test_parts_are_turned_and_moved_with_their_object() -> None:
    thing = PushedObject(
        shape="polygon", points_m=[[0.0, 0.0], [0.2, 0.0], [0.0, 0.1]], mass_kg=1.0
    )
    (part,) = areas_at(thing, [1.0, 2.0, math.pi / 2])
    for found, expected in zip(part.outline, [(1.0, 2.0), (1.0, 2.2), (0.9, 2.0)], strict=True):
        assert found == pytest.approx(expected)
    assert overlap(part, disc(0.98, 2.05, 0.01))
    assert not overlap(parts_of(thing)[0], disc(0.98, 2.05, 0.01))
