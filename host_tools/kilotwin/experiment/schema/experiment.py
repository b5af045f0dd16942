"""Every key an experiment file may have, with its range, default and meaning. The only place that
says so, with the tables beside it (`grid_schema`, `environment_schema`): `docs/experiments.md` is
made from here.

Units are in the keys. Shares are 0 to 1. What only makes sense together with other keys is checked
in `checks`. Defaults that depend on the robot come from `profile_defaults`.
"""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from kilotwin.experiment.colours import LED_COLOURS, led_triple, site_colour
from kilotwin.experiment.programs import Printf, Runtime
from kilotwin.experiment.schema.controller import AggregationTables, InformedShares, with_defaults
from kilotwin.experiment.schema.environment import EnvironmentTable, OverheadController
from kilotwin.experiment.schema.expect import Expect
from kilotwin.experiment.schema.grid import CellColour, Faults, Grid, grid_size_m
from kilotwin.experiment.schema.hunt import Hunt
from kilotwin.experiment.schema.medium import MEDIA, Medium
from kilotwin.experiment.schema.metric import Metric
from kilotwin.experiment.schema.object import PushedObject
from kilotwin.experiment.schema.picture import FloorTable, LightPicture
from kilotwin.experiment.schema.profile_defaults import (
    PROFILES,
    SHORT_S,
    Profile,
    motion_defaults,
)
from kilotwin.experiment.schema.record import Record
from kilotwin.experiment.schema.section import (
    MOST_ROBOTS,
    Byte,
    Count,
    Heading,
    Length,
    MessageData,
    MessageType,
    Outline,
    Point,
    Pose,
    Reading10,
    Rectangle,
    Section,
    Shape,
    Spread,
    Text,
    Uid,
    one_or_more,
)
from kilotwin.experiment.schema.start import Formation, PoseColumns
from kilotwin.experiment.schema.step import Step
from kilotwin.units import TICK_S, ticks

ProfileName = Literal["foot-bot", "kilobot"]
Cpu = Literal["auto", "native", "translated", "avr"]
SiteShape = Literal["circle", "rectangle", "polygon", "picture"]
# Message types of hardware.md 1.4; `pause` is what people call WAKEUP.
Sent = Literal[
    "run",
    "pause",
    "wakeup",
    "sleep",
    "reset",
    "voltage",
    "charge",
    "readuid",
    "calib",
    "user",
]


def _named_colour(text: str) -> str:
    site_colour(text)
    return text


def _led_names() -> str:
    """Every name of an LED's colour with its intensities."""
    return ", ".join(f'`"{name}"` {list(rgb)}' for name, rgb in LED_COLOURS.items())


class Arena(Section):
    """The wall; its middle is (0, 0)."""

    shape: Shape = "circle"
    """The wall's shape."""
    diameter_m: Length | None = None
    """Diameter of a circle."""
    width_m: Length | None = None
    """Size of a rectangle along x."""
    height_m: Length | None = None
    """Size of a rectangle along y."""
    points_m: Outline | None = None
    """Corners [x, y] of a polygon, one after the other, in either order."""
    blocks_light: bool | None = None
    """Whether the walls of a polygon stop light where one is between."""


class Obstacle(Section):
    """Something solid that stands in the arena; obstacles may overlap and reach into the wall."""

    shape: Shape = "circle"
    """Its shape."""
    centre_m: Point | None = None
    """Its middle, [x, y]; for a polygon, where (0, 0) of its points is. [0, 0] if left out."""
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
    blocks_light: bool
    """Whether it stops infrared messages and the light of lamps."""


class Site(Section):
    """A spot on the floor. Robots know it by its number: its place in the file, from 1."""

    name: Text
    """Its name in tables and figures."""
    shape: SiteShape = "circle"
    """Its shape; "picture" for one that `[floor.legend]` names, which needs no [[site]]."""
    centre_m: Point | None = None
    """Its middle, [x, y]; for a polygon, where (0, 0) of its points is. [0, 0] if left out."""
    diameter_m: Length | None = None
    """Diameter of a circle."""
    width_m: Length | None = None
    """Size of a rectangle along x."""
    height_m: Length | None = None
    """Size of a rectangle along y."""
    points_m: Outline | None = None
    """Corners [x, y] of a polygon, one after the other, in either order."""
    colour: Annotated[str, AfterValidator(_named_colour)] | None = None
    """In pictures: a colour's name or #rrggbb."""
    light: CellColour | None = None
    """On a grid: the light of its cells. If left out: green, blue, yellow ... in turn."""


Gain = Annotated[list[Reading10], Field(min_length=3, max_length=3)]


class Swarm(InformedShares):
    """The robots. `program` and `size`, or `[[robots]]` for several programs."""

    profile: ProfileName
    """The kind of robot: body, motors, medium, and the defaults of many keys."""
    program: Annotated[
        Annotated[list[Text], Field(min_length=1)] | None, BeforeValidator(one_or_more)
    ] = None
    """A `.c` file, a folder whose `.c` files are one program, or a list of `.c` files."""
    size: Count | None = None
    """How many robots run it."""
    cpu: Cpu = "auto"
    """Processor of `program`, and of each `[[robots]]` that has a program and says nothing else:
    see `robots.cpu`."""
    runtime: Runtime
    """Runtime of robots built from C: `original` has the traits of the published kilolib,
    `kilotwin` is ours; see `robots.runtime`."""
    wire: Text | None = None
    """A file that declares the parameters of the robots' program, for `[parameters]`."""
    lab: Text | None = None
    """A `lab.toml` whose robots these are, by uid from the lowest on: uids, duties, gains."""
    gains: Annotated[list[Gain], Field(min_length=2)] | None = None
    """Readings of a lab's robots at a few distances, each [mm from centre to centre, low gain, high
    gain], nearest first: one table for all robots that `lab` has none of. Between them it is
    linear, nearer and farther constant."""
    first_uid: Uid | None = None
    """The uid of the first robot; the others follow it. 1 if left out; see `robots.uids`."""
    on_s: Annotated[float, Field(ge=0, le=86_400)] | None = None
    """How long robots have been on when the run begins, waiting for RUN: as much have their
    `kilo_ticks` counted. 0 if left out. Robots on an ATmega328P wait for it, which takes time."""
    floor: bool
    """Whether the virtual floor sends robots their site, walls and obstacles (message CELL)."""
    start: Literal["uniform"] = "uniform"
    """Where robots without poses start: anywhere, or anywhere in `start_in_m`."""
    start_in_m: Rectangle | None = None
    """Robots without poses start in this rectangle: [left, bottom, right, top]."""


class Robots(Section):
    """One kind of robot of a mixed swarm."""

    program: Annotated[
        Annotated[list[Text], Field(min_length=1)] | None, BeforeValidator(one_or_more)
    ] = None
    """A `.c` file, a folder whose `.c` files are one program, or a list of `.c` files."""
    hex: Text | None = None
    """Instead of `program`: a `.hex` or `.elf` for the ATmega328P, run as it would be flashed."""
    cpu: Cpu | None = None
    """Processor of `program`: `native`, this computer by the program's C; `translated`, this
    computer by the robot's machine code, with its cycles and its 16-bit `int`; `avr`, each robot's
    ATmega328P (`kilobot` medium only). `auto`: Kilobots run translated, foot-bots natively, and so
    do Kilobots where avr-gcc is missing or a program lacks `kilo_start()`; programs with interrupt
    handlers of their own, or for registers that only a chip has, on it. A line says so."""
    runtime: Runtime | None = None
    """`original`: a robot acts on RUN when its blink ends, within 201 ms; after `get_voltage()` the
    next distance is wrong; frames are lost while interrupts are held back for 17 us or more, as
    `rand_hard()` does for half a millisecond; `estimate_distance()` and `message_crc()` take as
    long as there; Kilotwin's own requests get no answer. `kilotwin`: ours. If left out: as
    `swarm.runtime`, or ours beside our boot loader."""
    printf: Printf = "integers"
    """`floats`: `printf("%f")` of an image prints the number, and takes 1.5 KB more flash, as with
    `-Wl,-u,vfprintf -lprintf_flt` in a Makefile. `integers`: it prints `?`, as without. Native
    programs always print the number."""
    boot_loader: bool = False
    """Whether their flash also holds Kilotwin's boot loader, for flashing over the air; ATmega328P
    only."""
    include: list[Text] = []
    """Folders to look for headers in, besides the program's own."""
    define: list[Text] = []
    """Macros for the compiler: "NAME", "NAME=value" or "NAME(a,b)=value"."""
    flavour: Literal["kilobot", "kilogrid"] | None = None
    """API of the program: kilolib, or the Kilogrid's flavour of it with its helpers. If left out,
    found from its `.c` files (`IR_message_t`, `kilogrid.h`, `kilob_*.h`)."""
    count: Annotated[int, Field(ge=0, le=MOST_ROBOTS)]
    """How many robots run it; as many as there are poses, if these come from a file. 0: none, for
    a condition of a sweep."""
    poses: list[Pose] | None = None
    """Pose of each at the start, [x_m, y_m, heading_rad]; or a file that has them: a CSV or JSON
    table, Kilombo's JSON, or a run folder, of which the last sample is taken. Anywhere if left
    out."""
    columns: PoseColumns | None = None
    """Names of that file's columns, where they are neither ours nor Kilombo's."""
    formation: Formation | None = None
    """In place of `poses`: robots that start together."""
    uids: Annotated[list[Uid], Field(min_length=1)] | None = None
    """The uid of each, which is index + 1 if left out. With `swarm.lab`, which of its robots they
    are."""
    first_uid: Uid | None = None
    """In place of `uids`: that of the first; the others follow it."""


class Motion(Section):
    """How a Kilobot moves, and how its motors differ from the next one's and from themselves.

    The foot-bot's motion is fixed and ideal.
    """

    speed_m_s: Annotated[float, Field(gt=0, le=1)]
    """Speed with both motors at their straight duties."""
    turn_rad_s: Annotated[float, Field(gt=0, le=5)]
    """Turning speed with one motor at its turn duty."""
    mass_kg: Annotated[float, Field(ge=0.001, le=100)]
    """Mass of a robot. 10 g is what others simulate (hardware.md 2); the foot-bot's is a guess."""
    push_n: Annotated[float, Field(gt=0, le=1000)]
    """Largest force of its drive, and of table friction while its motors are off. A guess."""
    kick_needed: bool
    """Whether a motor at rest needs 15 ms at full duty (`spinup_motors()`) to start."""
    gives_way: bool
    """Whether a standing robot can be pushed; if not, others meet it as a wall."""
    speed_spread: Spread
    """Speed between robots: standard deviation, share of the speed."""
    bias_spread: Spread
    """Speed between motors: standard deviation, share. Such a robot walks in a bend."""
    motor_noise: Spread
    """Speed of a motor from second to second: standard deviation, share."""


class Source(Section):
    """A lamp above the arena."""

    at_m: Point
    """The point below it, [x, y]."""
    peak: Reading10
    """Its share of the reading there."""
    half_m: Length
    """Distance from there at which half of `peak` is left."""


class Light(Section):
    """Reading of `get_ambientlight()`, 0 to 1023."""

    ambient: Reading10 = 0.0
    """The reading without any lamp."""
    source: list[Source] = []
    """Lamps, as [[light.source]] tables."""
    picture: LightPicture | None = None


class Battery(Section):
    """Reading of `get_voltage()`."""

    hours: Annotated[float, Field(ge=0, le=1000)] = 0.0
    """How long a full battery lasts while the robot drives; 0: for ever."""


class Command(Section):
    """A message of the overhead controller, to all robots unless keys name some.

    Without any [[command]] robots get RUN at 0. One [[command]] or more take its place.
    """

    at_s: Annotated[float, Field(ge=0, le=1e9)]
    """Seconds from the start of the run; before its end, unless `--set` made the run shorter."""
    send: Sent
    """Which message; `pause` and `wakeup` are the same."""
    repeat_s: Annotated[float, Field(ge=0, le=3600)] = 0.0
    """How long it is repeated, once a tick; 0: once. `wakeup` may need 48 s: docs/limits.md."""
    robot: Uid | None = None
    """Only to the robot with this uid: 1 for the first robot and so on, unless CALIB, `uids` or
    `swarm.lab` changed it."""
    uid_first: Uid | None = None
    """Only to robots from this uid on; 0 if left out."""
    uid_last: Uid | None = None
    """Only to robots up to this uid; 65535 if left out."""
    centre_m: Point | None = None
    """Only to robots near this point, [x, y] ..."""
    within_m: Length | None = None
    """... with centres at most this far away."""
    bit: Annotated[int, Field(ge=0, le=15)] | None = None
    """readuid: the bit of its uid that a robot shows; it turns left if the bit is set."""
    mode: Literal["save", "uid", "turn_left", "turn_right", "straight"] | None = None
    """calib: the motion to show, or `save` to keep the values of the message."""
    uid: Uid | None = None
    """calib, save: the robot's new uid."""
    turn_left: Byte | None = None
    """calib: duty of the left motor in a left turn."""
    turn_right: Byte | None = None
    """calib: duty of the right motor in a right turn."""
    straight_left: Byte | None = None
    """calib: duty of the left motor straight on."""
    straight_right: Byte | None = None
    """calib: duty of the right motor straight on."""
    type: MessageType | None = None
    """user: the message's type."""
    data: MessageData | None = None
    """user: the message's bytes, zeros after them."""


class Engine(Section):
    """How the world is computed."""

    step_ticks: Literal[1, 2, 4]
    """The world's step, in ticks of 32.768 ms."""
    avr_core: Literal["translated", "interpreted"] = "translated"
    """How an ATmega328P's code is executed: translated to this computer's if it has a C compiler,
    or interpreted; the result is the same."""
    threads: Annotated[int, Field(ge=1, le=32)] | None = None
    """Threads that step the world; the result is the same. If left out, `kilotwin run` takes one
    for fewer than 4,000 robots, and as many as there are cores for more, 8 at most. Trials of a
    sweep, and whatever else runs many at once, have one each, whatever is said here; so has a run
    with robots on an ATmega328P."""

    @model_validator(mode="before")
    @classmethod
    def _without_box2d(cls, raw: Any) -> Any:
        """Leaves out `contact_solver = "box2d"`, which run folders of 1.0 and older have."""
        if isinstance(raw, dict) and raw.get("contact_solver") == "box2d":
            return {key: value for key, value in raw.items() if key != "contact_solver"}
        return raw


def _light_at_walls(raw: dict[str, Any], blocks: bool) -> dict[str, Any]:
    """Arena and obstacles, where left out with what the robots' light does at walls."""
    filled: dict[str, Any] = {}
    arena, obstacles = raw.get("arena"), raw.get("obstacle")
    if isinstance(arena, dict) and arena.get("shape") == "polygon":
        filled["arena"] = {"blocks_light": blocks, **arena}
    if isinstance(obstacles, list):
        filled["obstacle"] = [
            {"blocks_light": blocks, **obstacle} if isinstance(obstacle, dict) else obstacle
            for obstacle in obstacles
        ]
    return filled


def _drawn_sites(raw: dict[str, Any]) -> dict[str, Any]:
    """The sites, and those of the floor's legend that are not among them."""
    floor, sites = raw.get("floor"), raw.get("site", [])
    legend = floor.get("legend") if isinstance(floor, dict) else None
    if not isinstance(legend, dict) or not isinstance(sites, list):
        return {}
    known = [site.get("name") for site in sites if isinstance(site, dict)]
    more: dict[str, dict[str, Any]] = {}
    for colour, name in legend.items():
        if isinstance(name, str) and name and name not in known and name not in more:
            more[name] = {"name": name, "shape": "picture", "colour": colour}
    return {"site": [*sites, *more.values()]}


def _sample_s(duration_s: Any, profile: Profile) -> float:
    """The default of record.sample_s; a duration that is none is refused later."""
    is_short = isinstance(duration_s, int | float) and duration_s <= SHORT_S
    return profile.short_sample_s if is_short else profile.sample_s


class ExperimentSchema(AggregationTables):
    """A whole experiment file."""

    name: Text
    """Its name in figures and run folders; the file's name if left out."""
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 1
    """All chance comes from it: same seed, same run."""
    duration_s: Annotated[float, Field(ge=TICK_S, le=1e9)]
    """Simulated time."""
    temperature: Annotated[int, Field(ge=0, le=1023)] = 300
    """Reading of `get_temperature()`, 0 to 1023."""
    arena: Arena
    obstacle: Annotated[list[Obstacle], Field(max_length=1000)] = []
    object: Annotated[list[PushedObject], Field(max_length=1000)] = []
    site: Annotated[list[Site], Field(max_length=255)] = []
    floor: FloorTable | None = None
    swarm: Swarm
    robots: list[Robots] | None = None
    parameters: Annotated[dict[Text, Any], Field(max_length=100)] | None = Field(
        default=None,
        description="Parameters of the robots' program by name, as swarm.wire declares them: "
        "docs/parameters.md.",
    )
    motion: Motion | None = None
    medium: Medium
    light: Light = Light.model_construct()
    battery: Battery = Battery.model_construct()
    command: list[Command] | None = None
    step: Annotated[list[Step], Field(max_length=10_000)] = []
    environment: EnvironmentTable | None = None
    overhead: Annotated[list[OverheadController], Field(max_length=100)] = []
    grid: Grid | None = None
    faults: Faults = Faults.model_construct()
    record: Record
    metric: Annotated[dict[Text, Metric], Field(max_length=100)] = {}
    expect: Annotated[list[Expect], Field(max_length=1000)] = []
    hunt: Hunt | None = None
    engine: Engine
    states: dict[Text, Annotated[list[int], BeforeValidator(led_triple)]] | None = Field(
        default=None,
        description="LED colours by the name of what they mean: [r, g, b] with 0 to 3 each, as in "
        f"RGB(r, g, b), or a colour's name: {_led_names()}.",
    )

    @property
    def sample_ticks(self) -> int:
        """Ticks from one sample of an emulated run to the next: a world step at least."""
        return max(ticks(self.record.sample_s), self.engine.step_ticks)

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
        profile = PROFILES[name]
        filled = dict(raw)
        if "arena" not in raw and (size := grid_size_m(raw.get("grid"))):
            filled["arena"] = {"shape": "rectangle", "width_m": size[0], "height_m": size[1]}
        filled |= _light_at_walls(filled, profile.line_of_light)
        filled |= _drawn_sites(raw)
        if isinstance(swarm, dict):
            floor = profile.virtual_floor and "grid" not in raw
            filled["swarm"] = {"floor": floor, "runtime": profile.runtime, **swarm}
        medium = raw.get("medium", {})
        if isinstance(medium, dict):
            kind = medium.get("kind", profile.medium)
            own = MEDIA[kind].keys if kind in MEDIA else {}
            filled["medium"] = {"kind": kind, "range_m": profile.range_m, **own, **medium}
        engine = raw.get("engine", {})
        if isinstance(engine, dict):
            filled["engine"] = {"step_ticks": profile.step_ticks, **engine}
        record = raw.get("record", {})
        if isinstance(record, dict):
            filled["record"] = {"sample_s": _sample_s(raw.get("duration_s"), profile), **record}
        motion = raw.get("motion", {} if profile.legs else None)
        if isinstance(motion, dict):
            filled["motion"] = {**motion_defaults(profile), **motion}
        filled |= with_defaults(raw, name)
        return filled
