"""The `[metric.NAME]` tables of an experiment: numbers that are measured at each sample.

A metric is a built-in, a Python function of the user's, or a variable of the robots' program. What
each built-in is, and which keys it takes, is said in BUILTINS alone.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from kilotwin.experiment.schema.section import Length, Outline, Point, Section, Shape, Text

BuiltinName = Literal[
    "share",
    "number",
    "mean_distance",
    "spread",
    "hull_area",
    "clusters",
    "largest_cluster",
    "order",
    "coverage",
    "object_distance",
    "messages",
    "message_rate",
    "survival",
    "first_time",
]
Number = Annotated[float, Field(ge=-1e12, le=1e12)]


@dataclass(frozen=True)
class Builtin:
    """One of them: its unit, what it is, and the keys it needs and may have besides."""

    unit: str
    meaning: str
    needs: tuple[str, ...] = ()
    may_have: tuple[str, ...] = ()


CHOICE = ("state", "site", "region")
"""Keys that choose robots: those in a state, on a site, inside a region; in all that are given."""

BUILTINS: dict[str, Builtin] = {
    "share": Builtin("share", "robots chosen, as a share of all", may_have=CHOICE),
    "number": Builtin("robots", "robots chosen", may_have=CHOICE),
    "mean_distance": Builtin("m", "distance between two robots, mean over pairs", (), CHOICE),
    "spread": Builtin("m", "distance from their middle, root mean square", (), CHOICE),
    "hull_area": Builtin("m2", "area of their convex hull", (), CHOICE),
    "clusters": Builtin(
        "clusters", "groups of robots with gaps of within_m at most", ("within_m",), CHOICE
    ),
    "largest_cluster": Builtin("robots", "robots in the largest of them", ("within_m",), CHOICE),
    "order": Builtin("share", "length of the mean heading: 1 if all face one way", (), CHOICE),
    "coverage": Builtin(
        "share",
        "squares of the arena, cell_m wide, in which a robot was at any sample until then",
        ("cell_m",),
        CHOICE,
    ),
    "object_distance": Builtin("m", "from an object to goal_m", ("goal_m",), ("object",)),
    "messages": Builtin("messages", "messages sent since the start, per robot"),
    "message_rate": Builtin("1/s", "messages sent per robot and second, since the last sample"),
    "survival": Builtin("share", "robots whose program runs, as a share of all"),
    "first_time": Builtin(
        "s",
        "when another metric first reached at_least or at_most",
        ("metric",),
        ("at_least", "at_most"),
    ),
}


class Region(Section):
    """A place that chooses robots."""

    shape: Shape = "circle"
    """Its shape."""
    centre_m: Point | None = None
    """Its middle, [x, y]; for a polygon, where (0, 0) of its points is."""
    diameter_m: Length | None = None
    """Diameter of a circle."""
    width_m: Length | None = None
    """Size of a rectangle along x."""
    height_m: Length | None = None
    """Size of a rectangle along y."""
    points_m: Outline | None = None
    """Corners [x, y] of a polygon, one after the other, in either order."""


class Metric(Section):
    """A number that is measured, by one of `builtin`, `function` and `variable`."""

    builtin: BuiltinName | None = None
    """A metric of Kilotwin's own: docs/metrics.md has each with its keys."""
    function: Text | None = None
    """A Python function in a file, as "analysis.py:spread", called as spread(sample)."""
    variable: Text | None = None
    """A variable of the robots' program: "hops", "file.c:hops", "me.hops" or "table[2]"."""
    unit: Text | None = None
    """For axes and tables; a built-in has its own."""
    meaning: Text | None = None
    """For axes and tables; a built-in has its own."""
    when: Literal["samples", "end"] = "samples"
    """At each sample, or at the end of the run alone."""
    of: Literal["mean", "sum", "least", "most"] = "mean"
    """variable: how the robots' values are combined."""
    per_robot: bool = False
    """variable: whether the table `robots` keeps each robot's value too."""
    state: Text | None = None
    """Only robots in this state, as [states] calls it."""
    site: Text | None = None
    """Only robots on this site."""
    region: Region | None = None
    within_m: Length | None = None
    """clusters, largest_cluster: largest gap between neighbours of one cluster."""
    cell_m: Annotated[float, Field(ge=0.001, le=1000)] | None = None
    """coverage: the side of a square."""
    object: Annotated[int, Field(ge=0, le=999)] | None = None
    """object_distance: which [[object]], 0 if left out."""
    goal_m: Point | None = None
    """object_distance: a point, [x, y]."""
    metric: Text | None = None
    """first_time: the name of another metric."""
    at_least: Number | None = None
    """first_time: the least value that counts."""
    at_most: Number | None = None
    """first_time: the largest value that counts."""

    @property
    def shown_unit(self) -> str:
        """Its unit, "" if the file does not say."""
        return self.unit or (BUILTINS[self.builtin].unit if self.builtin else "")

    @property
    def shown_meaning(self) -> str:
        """Its meaning, "" if the file does not say."""
        return self.meaning or (BUILTINS[self.builtin].meaning if self.builtin else "")
