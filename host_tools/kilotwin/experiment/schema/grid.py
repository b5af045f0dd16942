"""Tables of an experiment file about a Kilogrid: modules, cells, and what goes wrong."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from kilotwin.experiment.programs import Runtime
from kilotwin.experiment.schema.robot_fault import RobotFault
from kilotwin.experiment.schema.section import (
    Length,
    Module,
    Modules,
    Section,
    Share,
    Text,
    one_or_more,
)
from kilotwin.files.headers import MODULE_M, MOST_COLUMNS, MOST_PER_BUS

FaultKind = Literal["dead", "reset", "bus_off", "recover"]
# The 3-bit colours of a module's lights.
CellColour = Literal["off", "red", "green", "yellow", "blue", "magenta", "cyan", "white"]


class GridChange(Section):
    """Changes of cells in mid-run. Modules that change are configured and started again."""

    at_s: Annotated[float, Field(gt=0, le=1e9)]
    """Seconds from the start of the run; before its end, unless `--set` made the run shorter."""
    swap: Annotated[list[Text], Field(min_length=2, max_length=2)] | None = None
    """Two sites by name: the cells of each become the other's."""
    configuration: Text | None = None
    """Or a `.kconf` file, for the modules that it names."""


class GridCells(Section):
    """The infrared between cells and robots, emulated, centre to centre; see docs/limits.md."""

    cell_range_m: Length = 0.036
    """Distance up to which a robot receives a cell."""
    robot_range_m: Length = 0.045
    """Distance up to which a cell receives a robot."""
    weak_share: Share = 0.0
    """Share of the time in which a robot is hardly received, in spells."""
    weak_range_m: Length = 0.01
    """Distance up to which a cell receives it then."""
    weak_spell_s: Annotated[float, Field(ge=1, le=1e6)] = 120.0
    """Length of a spell."""
    loss: Share = 0.05
    """Share of robots' frames lost at a cell by chance."""
    clock_spread: Annotated[float, Field(ge=0, le=0.05)] = 0.0001
    """The oscillator's rate between modules: standard deviation, share."""


SITES = "kilogrid_modules/sites"
"""The module program that comes with Kilotwin."""


class Grid(Section):
    """A Kilogrid under the robots, its modules 10 cm wide with 2 x 2 cells. It makes the arena.

    Cells tell robots of sites and walls: a cell belongs to a site if its middle lies inside.
    """

    columns: Modules
    """Modules along x."""
    rows: Modules
    """Modules along y."""
    buses: Annotated[int, Field(ge=1, le=8)] = 4
    """CAN buses; each has an equal share of the rows, 112 modules at most."""
    program: Annotated[list[Text], Field(min_length=1), BeforeValidator(one_or_more)] = [SITES]
    """The modules' program: a `.c` file, a folder, or a list of `.c` files."""
    hex: Text | None = None
    """Instead of `program`: a `.hex` or `.elf` for the modules' ATmega328P, as it is flashed."""
    cpu: Literal["native", "avr"] | None = None
    """Processor of `program`: this computer, or modules' ATmega328P (`kilobot` medium only)."""
    runtime: Runtime | None = None
    """Runtime of `program`. `original`: the known traits of the published one, whose programs get
    health requests, questions to robots and their answers. `kilotwin`, if left out: ours."""
    boot_loader: bool = False
    """Whether their flash also holds Kilotwin's boot loader, for flashing over CAN; ATmega328P
    only."""
    include: list[Text] = []
    """Folders to look for headers in, besides the program's own."""
    define: list[Text] = []
    """Macros for the compiler: "NAME", "NAME=value" or "NAME(a,b)=value"."""
    configuration: Text | None = None
    """A `.kconf` file for the modules, in place of [[site]] and `wall_cells`."""
    wall_cells: Annotated[int, Field(ge=0, le=MOST_COLUMNS)] = 1
    """Width of the ring of wall cells along the edge."""
    poll_s: Annotated[float, Field(ge=0.05, le=60)] = 0.4
    """From one poll of a module to the next."""
    poll_window: Annotated[int, Field(ge=1, le=MOST_PER_BUS)] = 16
    """How many polls of a bus may be open at a time."""
    poll_timeout_s: Annotated[float, Field(ge=0.02, le=10)] = 0.4
    """When an answer is late. Keep the sum with `poll_s` at 1.2 s or less: a reset module is silent
    that long, then answers late what its controller kept; a reset is noticed only if that takes
    longer than this."""
    pace_s: Annotated[float, Field(ge=0.0005, le=0.1)] = 0.001
    """From one frame of the host to the next that may be for the same module."""
    report_s: Annotated[float, Field(ge=0, le=2147)] = 2.0
    """From one report of a robot to the next; 0: none. Only `firmware/aggregation` obeys."""
    hold_s: Annotated[float, Field(ge=0.1, le=60)] = 2.0
    """How long modules repeat each message for robots before the run."""
    rounds: Annotated[int, Field(ge=1, le=10)] = 2
    """How often all these messages are sent."""
    health: bool = False
    """Whether the host requests health after set-up and after a late answer. Ours answer; original
    modules are judged by their answers to polls."""
    kilobot_ids: Text | None = None
    """A file with a serial and an id per robot, for the `.kilodat`; its first line may be a
    header."""
    cells: GridCells = GridCells.model_construct()
    change: list[GridChange] = []


class ModuleFault(Section):
    """The fault of a module."""

    at_s: Annotated[float, Field(ge=0, le=1e9)]
    """Seconds from the start of the run; before its end, unless `--set` made the run shorter."""
    kind: FaultKind
    """`dead`: it goes silent. `reset`: it loses power for a moment. `bus_off`, `recover`: its CAN
    controller goes off, comes back."""
    module: Module
    """Which: [column, row]."""


class HostFault(Section):
    """The host is gone for a while: it neither sends nor receives."""

    from_s: Annotated[float, Field(ge=0, le=1e9)]
    """From when, in seconds from the start of the run; before its end."""
    until_s: Annotated[float, Field(ge=0, le=1e9)]
    """Until when; that may be after the end."""


class Faults(Section):
    """Robots that fail, and faults of an emulated grid."""

    robot: Annotated[list[RobotFault], Field(max_length=1000)] = []
    error_share: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    """On a grid: share of CAN frames that an error destroys; they are sent again."""
    module: list[ModuleFault] = []
    host: list[HostFault] = []


def grid_size_m(grid: Any) -> tuple[float, float] | None:
    """Width and height of a [grid] as it was written, if it tells them."""
    if not isinstance(grid, dict):
        return None
    columns, rows = grid.get("columns"), grid.get("rows")
    if type(columns) is not int or type(rows) is not int or min(columns, rows) < 1:
        return None
    return round(columns * MODULE_M, 6), round(rows * MODULE_M, 6)
