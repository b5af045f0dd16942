"""Every key an experiment file may have, with its range and default. The only place that says so.

Units are in the keys. Shares are 0 to 1. What only makes sense together with other keys is checked
in `experiment_checks`. Defaults that depend on the robot come from `profiles`.
"""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from kilotwin.colours import led_triple, site_colour
from kilotwin.profiles import CONTROLLER_DEFAULTS, PROFILES
from kilotwin.units import TICK_S

Text = Annotated[str, Field(min_length=1, max_length=200)]
Length = Annotated[float, Field(gt=0, le=1000)]
Coordinate = Annotated[float, Field(ge=-1000, le=1000)]
Share = Annotated[float, Field(ge=0, le=1)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
# CONFIG carries reals as 32 bits of Q16 and most periods as 16 bits of ticks (wire.h).
Real = Annotated[float, Field(ge=0, le=65535)]
Period = Annotated[float, Field(ge=TICK_S, le=2147)]
Pause = Annotated[float, Field(ge=0, le=2147)]
Window = Annotated[float, Field(ge=TICK_S, le=1048)]

ProfileName = Literal["foot-bot"]
Shape = Literal["circle", "rectangle"]


def _named_colour(text: str) -> str:
    site_colour(text)
    return text


class Section(BaseModel):
    """A table of the file: no unknown keys, no text for numbers, no NaN."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


class Arena(Section):
    """The wall; its middle is (0, 0)."""

    shape: Shape = "circle"
    diameter_m: Length | None = None
    width_m: Length | None = None
    height_m: Length | None = None


class Site(Section):
    """A spot on the floor. Robots know it by its number: its place in the file, from 1."""

    name: Text
    shape: Shape = "circle"
    centre_m: Annotated[list[Coordinate], Field(min_length=2, max_length=2)]
    diameter_m: Length | None = None
    width_m: Length | None = None
    height_m: Length | None = None
    colour: Annotated[str, AfterValidator(_named_colour)] | None = None


class Swarm(Section):
    """Who is there. `program` and `size`, or `[[robots]]` for several programs."""

    profile: ProfileName
    program: Text | None = None
    size: Count | None = None
    informed: Share = 0.0
    informed_for: dict[str, Share] = {}
    start: Literal["uniform"] = "uniform"


class Robots(Section):
    """One kind of robot of a mixed swarm; `poses` are [x_m, y_m, heading_rad] each."""

    program: Text
    count: Count
    poses: list[Annotated[list[Coordinate], Field(min_length=3, max_length=3)]] | None = None


class Controller(Section):
    """The parameters of `firmware/aggregation`, sent as CONFIG before the run.

    Defaults stand in `profiles`. CONFIG sends a choice as its place in the list; so in Reading.
    """

    rule: Literal["simplified", "firat"]
    alpha: Real
    beta: Real
    a: Real
    k: Real
    update_s: Period
    straight_s: Period
    entry_s: Pause
    rho: Annotated[float, Field(ge=0, le=0.9999)]
    turn_s_per_rad: Annotated[float, Field(ge=TICK_S, le=2147)]
    control_step_s: Period
    neighbour_window_s: Window
    neighbour_timeout_s: Window
    neighbour_capacity: Annotated[int, Field(ge=1, le=100)]
    empty_windows: Annotated[int, Field(ge=1, le=255)]
    wall_ignore_s: Pause
    leave_turn: bool


class Reading(Section):
    """What the paper leaves open. The first of the choices is the default: reading A."""

    signal_from: Literal["rest", "crossing"] = "rest"
    first_leave: Literal["next_step", "full_period"] = "next_step"
    walk_out: Literal["walk", "rest"] = "walk"
    entry_obstacle: Literal["turn", "rest", "pause"] = "turn"
    line_of_sight: bool = True
    obstacle_m: Annotated[float, Field(ge=0.02, le=0.10)] = 0.05
    count_self: bool = False
    firat_join: Literal["crossing", "first_update", "every_update"] = "crossing"
    firat_signal_from: Literal["crossing", "rest"] = "crossing"
    start_on_site: Literal["entered", "must_leave"] = "entered"
    update_clock: Literal["own", "common"] = "own"


class Medium(Section):
    """How robots hear each other; centre to centre. Line of sight is `reading.line_of_sight`."""

    kind: Literal["ideal"] = "ideal"
    range_m: Length


class Record(Section):
    """How often poses, LED and states are written down."""

    sample_s: Annotated[float, Field(ge=TICK_S, le=1e6)] = 10.0


class Engine(Section):
    """The world's step, in ticks of 32.768 ms."""

    step_ticks: Literal[1, 2, 4] = 2


class ExperimentSchema(Section):
    """A whole experiment file."""

    name: Text
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 1
    duration_s: Annotated[float, Field(ge=TICK_S, le=1e9)]
    arena: Arena
    site: Annotated[list[Site], Field(max_length=255)] = []
    swarm: Swarm
    robots: list[Robots] | None = None
    controller: Controller | None = None
    reading: Reading = Reading()
    medium: Medium
    record: Record = Record()
    engine: Engine = Engine()
    states: dict[Text, Annotated[list[int], BeforeValidator(led_triple)]] | None = None

    @model_validator(mode="before")
    @classmethod
    def _defaults_of_the_profile(cls, raw: Any) -> Any:
        """Fills in what depends on the robot. A wrong profile is reported as such, nothing else."""
        if not isinstance(raw, dict):
            return raw
        swarm = raw.get("swarm")
        name = swarm.get("profile") if isinstance(swarm, dict) else None
        if not isinstance(name, str) or name not in PROFILES:
            name = next(iter(PROFILES))
        filled = dict(raw)
        medium = raw.get("medium", {})
        if isinstance(medium, dict):
            filled["medium"] = {"range_m": PROFILES[name].range_m, **medium}
        controller = raw.get("controller")
        if isinstance(controller, dict):
            merged = {**CONTROLLER_DEFAULTS[name], **controller}
            filled["controller"] = {"neighbour_timeout_s": merged["neighbour_window_s"], **merged}
        return filled
