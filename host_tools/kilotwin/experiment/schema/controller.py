"""[controller], [reading], and who is informed: the tables of `firmware/aggregation`.

They are what the paper's controllers take; experiments with other programs leave them out.
"""

import json
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from kilotwin.experiment.schema.section import Pause, Period, Real, Section, Share, Window
from kilotwin.units import TICK_S

ControllerDefaults = Mapping[str, str | float | bool]


class InformedShares(Section):
    """Keys of [swarm] that say which robots know a site."""

    informed: Share = 0.0
    """Share of the robots that know a site to gather on."""
    informed_for: dict[str, Share] = Field(default={})
    """Shares of the informed robots over the sites, by name; sum 1."""


class Controller(Section):
    """The parameters of `firmware/aggregation`, sent as CONFIG before the run.

    Defaults stand in `profiles`. CONFIG sends a choice as its place in the list; so in Reading.
    """

    rule: Literal["simplified", "firat"]
    """Which controller."""
    alpha: Real
    """`simplified`: P(leave) = alpha exp(-beta n)."""
    beta: Real
    """See alpha."""
    a: Real
    """`firat`: P(leave) = exp(-a (k - |n - x|))."""
    k: Real
    """See a."""
    update_s: Period
    """From one test of leaving to the next."""
    straight_s: Period
    """Duration of one leg of the random walk."""
    entry_s: Pause
    """How long it walks on into a site before it rests."""
    rho: Annotated[float, Field(ge=0, le=0.9999)]
    """Turns of the walk: 0 uniform, towards 1 straight on."""
    turn_s_per_rad: Annotated[float, Field(ge=TICK_S, le=2147)]
    """How long this robot takes to turn by one radian."""
    control_step_s: Period
    """From one reading of the floor to the next."""
    neighbour_window_s: Window
    """How long neighbours are counted for one n."""
    neighbour_timeout_s: Window
    """When a neighbour not received is forgotten; as the window if left out."""
    neighbour_capacity: Annotated[int, Field(ge=1, le=100)]
    """How many neighbours are distinguished."""
    empty_windows: Annotated[int, Field(ge=1, le=255)]
    """Windows without a neighbour after which n is 0."""
    wall_ignore_s: Pause
    """How long the wall is ignored after leaving it."""
    leave_turn: bool
    """Whether a robot that leaves turns first."""


class Reading(Section):
    """Questions that the paper leaves open. The first of the choices is the default: reading A.

    `pushed_off` depends on the robot.
    """

    signal_from: Literal["rest", "crossing"] = "rest"
    """`simplified`: when a robot on a site starts to signal."""
    first_leave: Literal["next_step", "full_period"] = "next_step"
    """When it first tests whether to leave."""
    walk_out: Literal["walk", "rest"] = "walk"
    """Action of one that walks off the site while it enters."""
    entry_obstacle: Literal["turn", "rest", "pause"] = "turn"
    """Action of one that meets an obstacle while it enters."""
    line_of_sight: bool = True
    """Whether other robots block a message; `ideal` medium only."""
    obstacle_m: Annotated[float, Field(ge=0.02, le=0.10)] = 0.05
    """From how near the floor reports an obstacle ahead."""
    count_self: bool = False
    """Whether n counts the robot itself."""
    firat_join: Literal["crossing", "first_update", "every_update"] = "crossing"
    """`firat`: when x is noted."""
    firat_signal_from: Literal["crossing", "rest"] = "crossing"
    """`firat`: when an informed robot starts to signal."""
    start_on_site: Literal["entered", "must_leave"] = "entered"
    """First state of a robot that starts on a site."""
    update_clock: Literal["own", "common"] = "own"
    """Whether update periods start with each robot's rest or at common times."""
    pushed_off: Literal["stay", "walk"]
    """Action of a robot at rest when it is pushed off its site; foot-bots never are."""


class AggregationTables(Section):
    """The tables of an experiment that are this program's."""

    controller: Controller | None = None
    reading: Reading


# Values that the paper fixes, for every robot.
_PAPER: ControllerDefaults = {
    "rule": "simplified",
    "alpha": 0.5,
    "beta": 2.25,
    "a": 2.0,
    "k": 18.0,
    "rho": 0.5,
    "control_step_s": 0.1,
    "neighbour_capacity": 100,
}

CONTROLLER_DEFAULTS: Mapping[str, ControllerDefaults] = {
    # paper.md 1 and 2; 18 ticks hear one frame per 16 ticks of everybody on a lossless medium.
    "foot-bot": {
        **_PAPER,
        "update_s": 2.0,
        "straight_s": 5.0,
        "entry_s": 10.0,
        "turn_s_per_rad": 0.70,
        "neighbour_window_s": 0.59,
        "empty_windows": 1,
        "wall_ignore_s": 0.0,
        "leave_turn": False,
    },
    # paper.md 5: times by 1.25; the firmware's own defaults (default_params.h) are these.
    "kilobot": {
        **_PAPER,
        "update_s": 2.5,
        "straight_s": 6.25,
        "entry_s": 12.5,
        "turn_s_per_rad": 1.27,
        "neighbour_window_s": 2.5,
        "empty_windows": 2,
        "wall_ignore_s": 16.0,
        "leave_turn": True,
    },
}

# [reading]: what a robot at rest does when it is pushed off its site. A foot-bot never is, but it
# may come to rest beside the rim of its site, and in the paper's runs it rests on there.
READING_DEFAULTS: Mapping[str, Mapping[str, str]] = {
    "foot-bot": {"pushed_off": "stay"},
    "kilobot": {"pushed_off": "walk"},
}


def with_defaults(raw: dict[str, Any], profile: str) -> dict[str, Any]:
    """The two tables with what they leave out, for a kind of robot; [controller] if it is there."""
    filled: dict[str, Any] = {}
    reading = raw.get("reading", {})
    if isinstance(reading, dict):
        filled["reading"] = {**READING_DEFAULTS[profile], **reading}
    controller = raw.get("controller")
    if isinstance(controller, dict):
        merged = {**CONTROLLER_DEFAULTS[profile], **controller}
        filled["controller"] = {"neighbour_timeout_s": merged["neighbour_window_s"], **merged}
    return filled


def reading_name(reading: Reading, profile: str) -> str:
    """The keys that are not at their defaults: `signal_from crossing, obstacle_m 0.02`."""
    fields = Reading.model_fields
    defaults = {key: field.default for key, field in fields.items() if not field.is_required()}
    defaults |= READING_DEFAULTS[profile]
    other = [
        f"{key} {json.dumps(value) if isinstance(value, bool) else value}"
        for key, value in reading
        if value != defaults[key]
    ]
    return ", ".join(other) or "reading A"
