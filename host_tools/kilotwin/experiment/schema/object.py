"""Tables of an experiment file about objects: rigid things on the table that robots push."""

from typing import Annotated, Literal

from pydantic import Field

from kilotwin.experiment.schema.section import (
    Heading,
    Length,
    MessageData,
    MessageType,
    Outline,
    Period,
    Point,
    Pose,
    Section,
    Shape,
)

Friction = Annotated[float, Field(ge=0, le=10)]
Mass = Annotated[float, Field(gt=0, le=1000)]


class ObjectPart(Section):
    """A part of a joined object. Where parts overlap, their mass counts twice."""

    shape: Shape = "circle"
    """Its shape."""
    centre_m: Point = [0.0, 0.0]
    """Its middle on the object, [x, y]; for a polygon, where (0, 0) of its points is."""
    heading_rad: Heading = 0.0
    """Its turn about that point, counter-clockwise."""
    diameter_m: Length | None = None
    """Diameter of a circle."""
    width_m: Length | None = None
    """Size of a rectangle along x, before it is turned."""
    height_m: Length | None = None
    """Size of a rectangle along y, before it is turned."""
    points_m: Outline | None = None
    """Corners [x, y] of a polygon, one after the other, in either order."""


class BeaconTable(Section):
    """A transmitter in an object, at its (0, 0): robots in range receive its message."""

    type: MessageType = 0
    """The message's type."""
    data: MessageData = []
    """The message's bytes, zeros after them."""
    period_s: Period = 0.5
    """From one message to the next; a robot's is 0.5. It has carrier sense, as robots do."""


class PushedObject(Section):
    """Something rigid on the table that robots push. It stops neither infrared nor light."""

    shape: Literal["circle", "rectangle", "polygon", "joined"] = "circle"
    """Its shape; "joined" for several [[object.part]] tables."""
    diameter_m: Length | None = None
    """Diameter of a circle."""
    width_m: Length | None = None
    """Size of a rectangle along x, before it is turned."""
    height_m: Length | None = None
    """Size of a rectangle along y, before it is turned."""
    points_m: Outline | None = None
    """Corners [x, y] of a polygon, one after the other, in either order."""
    part: Annotated[list[ObjectPart], Field(max_length=100)] = []
    pose: Pose | None = None
    """Its pose at the start, [x_m, y_m, heading_rad], of its middle or of (0, 0) of its points or
    parts. If left out, the seed draws a free place and a heading."""
    mass_kg: Mass
    """Its mass, spread evenly over its area."""
    friction: Friction = 0.3
    """Against sliding on the table: share of its weight. The default is a guess, as for paper."""
    turning_friction: Friction | None = None
    """Against turning on the table; as `friction` if left out."""
    robot_friction: Friction = 0.3
    """With robots and walls; between two objects, the product of both over 0.3. A guess."""
    beacon: BeaconTable | None = None
