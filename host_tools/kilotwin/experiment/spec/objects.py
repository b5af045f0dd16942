"""Objects that robots push: the parts that they are made of, and what the engine gets of them."""

from typing import Any

from kilotwin.experiment.areas import Area, area_of, placed
from kilotwin.experiment.convex import convex_pieces
from kilotwin.experiment.polygons import Corner
from kilotwin.experiment.schema.object import BeaconTable, ObjectPart, PushedObject
from kilotwin.experiment.spec.overhead import message
from kilotwin.units import ticks


def parts_of(thing: PushedObject) -> list[Area]:
    """Its parts in its own frame; its keys are complete."""
    if thing.shape == "joined":
        return [area_of(part) for part in thing.part]
    return [
        area_of(
            ObjectPart(
                shape=thing.shape,
                diameter_m=thing.diameter_m,
                width_m=thing.width_m,
                height_m=thing.height_m,
                points_m=thing.points_m,
            )
        )
    ]


def areas_at(thing: PushedObject, pose: list[float]) -> list[Area]:
    """Its parts on the table, where its frame is at `pose`."""
    return [placed(part, *pose) for part in parts_of(thing)]


def pieces_of(part: Area) -> list[list[Corner]]:
    """A part with corners as convex pieces; none of a circle."""
    return [] if part.circle else convex_pieces(part.outline)


def object_spec(thing: PushedObject) -> dict[str, Any]:
    """The engine's table."""
    turning = thing.friction if thing.turning_friction is None else thing.turning_friction
    return {
        "parts": [piece for part in parts_of(thing) for piece in _part_specs(part)],
        "pose": None if thing.pose is None else [float(value) for value in thing.pose],
        "mass_kg": float(thing.mass_kg),
        "friction": float(thing.friction),
        "turning_friction": float(turning),
        "robot_friction": float(thing.robot_friction),
        "beacon": None if thing.beacon is None else _beacon_spec(thing.beacon),
    }


def _beacon_spec(beacon: BeaconTable) -> dict[str, Any]:
    period_ticks = max(1, ticks(beacon.period_s))
    return {"message": message(beacon.data, beacon.type), "period_ticks": period_ticks}


def _part_specs(part: Area) -> list[dict[str, Any]]:
    if part.circle:
        centre = [float(part.x), float(part.y)]
        return [{"centre_m": centre, "radius_m": part.width / 2, "corners_m": []}]
    return [
        {
            "centre_m": [0.0, 0.0],
            "radius_m": 0.0,
            "corners_m": [[float(x), float(y)] for x, y in piece],
        }
        for piece in pieces_of(part)
    ]
