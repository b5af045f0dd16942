"""Where robots start: `[robots.formation]`, and `[robots.columns]` of a file of poses."""

from typing import Annotated, Literal

from pydantic import Field

from kilotwin.experiment.schema.section import Count, Heading, Length, Point, Section, Text


class Formation(Section):
    """Robots of one kind that start together; see `robots.formation`."""

    shape: Literal["line", "grid", "hexagon", "ring", "disc", "pile"]
    """`line` along x; `grid` of rows, from the lower left; `hexagon`, a lattice from its middle
    outward; `ring`; `disc`, anywhere in one that gives each a square of `pitch_m`; `pile`, pushed
    together by hand."""
    pitch_m: Length | None = None
    """Distance of neighbours, centre to centre. If left out, two diameters of a robot; in a pile
    1.1."""
    columns: Count | None = None
    """grid: robots of a row; as many as there are rows if left out."""
    centre_m: Point = [0.0, 0.0]
    """Its middle."""
    turn_rad: Heading = 0.0
    """By how much it is turned about its middle."""
    heading_rad: Heading | None = None
    """The heading of all; if left out the seed draws each robot's."""


class PoseColumns(Section):
    """Names of the columns of a file of poses: a tracker's table, or any other CSV or JSON file.

    Without it: `x_m`, `y_m`, `heading_rad`, or Kilombo's `x_position`, `y_position`, `direction`.
    """

    x: Text
    """The column of x."""
    y: Text
    """The column of y."""
    heading: Text | None = None
    """The column of headings; if left out the seed draws them."""
    unit_m: Annotated[float, Field(gt=0, le=1000)] = 1.0
    """Metres of a unit of x and y: 0.001 for mm, a pixel's size for a picture."""
    angle: Literal["rad", "deg"] = "rad"
    """Unit of headings."""
    y_down: bool = False
    """Whether y grows downwards, as in pictures; headings are then clockwise too."""
    zero: Annotated[
        list[Annotated[float, Field(ge=-1e9, le=1e9)]], Field(min_length=2, max_length=2)
    ] = [0.0, 0.0]
    """The arena's middle, [x, y], in units of the file."""
    where: list[Annotated[str, Field(pattern="^[^=]+=")]] = []
    """Only rows with these values, each as "frame=0"."""
