"""A simulated world to step and look at from Python: for a lab's own tests, and for exploring.

    with World("my.toml", seed=1) as world:
        world.run(10)
        assert world.leds[0] == RGB(0, 3, 0)

See docs/python_api.md. Nothing is recorded; `kilotwin run` does that. The engine runs in this
process.
"""

import functools
import inspect
import time
import warnings
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Field, ValidationError

from kilotwin import _emulator
from kilotwin.errors import InputError, KilotwinError, RunError
from kilotwin.experiment.colours import LED_VALUES, Led, led_byte
from kilotwin.experiment.experiment import Experiment, one_command
from kilotwin.experiment.programs import key_of
from kilotwin.experiment.schema.experiment import Robots
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.schema.section import Byte, Pose, Section, one_or_more
from kilotwin.experiment.spec.engine import engine_spec
from kilotwin.experiment.spec.overhead import (
    ALL_ROBOTS,
    DATA_BYTES,
    Region,
    message,
    message_of,
    region,
    uids,
)
from kilotwin.experiment.states import States
from kilotwin.experiment.text import ExperimentText, Setting, parse_setting
from kilotwin.experiment.validation_errors import input_error
from kilotwin.metrics.functions import LocalFunctions
from kilotwin.metrics.meter import Meter
from kilotwin.metrics.moment import Moment
from kilotwin.programs.group import build_all, settled, symbols_of
from kilotwin.programs.guest_symbols import GuestSymbols
from kilotwin.programs.translate.optimiser import Optimiser
from kilotwin.runs.environment_record import EnvironmentMemory
from kilotwin.runs.event_places import EventPlaces
from kilotwin.runs.folder import FAILURES
from kilotwin.runs.grid_record import GridMemory
from kilotwin.session.emulated import EmulatedWorld
from kilotwin.session.emulated_environment import EmulatedEnvironment
from kilotwin.session.emulated_grid import EmulatedHost, lead_ticks
from kilotwin.session.faster_code import FasterCode, expected
from kilotwin.session.loop import Attention, Companion, Each, Session
from kilotwin.session.steering import no_grid
from kilotwin.session.steps import Steps
from kilotwin.session.world_view import WorldView
from kilotwin.table.grid.controller import Controller
from kilotwin.units import seconds, ticks

__all__ = ["RGB", "InputError", "KilotwinError", "World"]

# As they come: Python's own, or out of an array.
Whole = int | np.integer[Any]
Real = float | np.floating[Any] | Whole

# Between two looks at Ctrl-C.
_CHUNK_S = 0.1
_NEVER_TICKS = 2**31 - 1
_LONGEST_S = 1e9
_CLOSED = "this world is closed"


def _round(where: list[float]) -> list[float]:
    if where[2] <= 0:
        raise ValueError("must have a radius above 0")
    return where


_Light = Annotated[int, Field(ge=0, le=3)]


class _Arguments(Section):
    """Arguments, checked as the keys of an experiment are, with the same errors."""

    experiment: str | None = None
    set: Annotated[list[str], BeforeValidator(one_or_more)] = Field(default=[])
    for_s: Annotated[float, Field(ge=0, le=_LONGEST_S)] = 0.0
    count: Annotated[int, Field(ge=0, le=ticks(_LONGEST_S))] = 0
    robot: int = 0
    name: str = ""
    data: Annotated[list[Byte], Field(max_length=DATA_BYTES)] = Field(default=[])
    type: Byte = 0
    within: Annotated[Pose, AfterValidator(_round)] | None = None
    red: _Light = 0
    green: _Light = 0
    blue: _Light = 0


def _checked(to: str = "World", /, **given: Any) -> _Arguments:
    """Arguments as Python's own values; InputError names the one that cannot be used."""
    try:
        return _Arguments.model_validate(plain(given))
    except ValidationError as error:
        raise input_error(_origin({}, [], to), error, schema=_Arguments) from None


def RGB(red: int, green: int, blue: int) -> int:  # noqa: N802 (as robot programs write it)
    """The LED byte of `set_color(RGB(red, green, blue))`; each is 0 to 3."""
    light = _checked("RGB", red=red, green=green, blue=blue)
    return Led(led_byte(light.red, light.green, light.blue))


class World:
    """Robots with their programs. A robot is given by its index, from 0.

    Numbers may be Python's or numpy's. Arrays are copies of the present moment. KilotwinError says
    what cannot be done.
    """

    def __init__(
        self,
        experiment: str | Path | None = None,
        *,
        seed: Whole | None = None,
        set: str | Sequence[str] = (),
        view: bool = False,
        **keys: Any,
    ) -> None:
        """The world of an experiment file, with `set=["swarm.size=3"]` as `kilotwin run --set` has.

        `set` may be a single text too. Without a file the world is made from `keys`: `program`,
        `count`, `poses` and the other keys of one `[[robots]]`, `arena` = (width, height) in m, a
        diameter or a polygon's corners, `profile`, and any table of an experiment file as a dict,
        as in `medium={"kind": "ideal"}`, or a list of them, as in `obstacle=[...]`.

        `view`: a page shows the world while it is stepped, and steers it (docs/viewer.md).
        """
        given = _checked(experiment=experiment, set=set)
        settings = [parse_setting(text) for text in given.set]
        if seed is not None:
            settings.append(Setting(("seed",), plain(seed), f"seed={seed}"))
        self._experiment = experiment_for(given.experiment, keys, settings)
        warn = functools.partial(warnings.warn, stacklevel=2)
        for note in self._experiment.why_native():
            warn(note)
        self._experiment = settled(self._experiment, warn)
        guests, modules = build_all(self._experiment)
        self._optimiser = Optimiser([*guests, *([modules] if modules else [])])
        self._ran_s = self._went_on_s = 0.0
        self._names = States.of(self._experiment.keys)
        functions = LocalFunctions(self._experiment) if self._experiment.functions else None
        self._debug_files = symbols_of(guests, modules)
        self._meter = Meter(self._experiment, functions, self._debug_files)
        self._symbols: dict[Path, GuestSymbols] = {}
        self._events: list[dict[str, Any]] = []
        spec = engine_spec(
            self._experiment,
            [str(guest.file) for guest in guests],
            sample_ticks=_NEVER_TICKS,
            black_box=None,
            module_guest="" if modules is None else str(modules.file),
            lead_ticks=lead_ticks(self._experiment),
            threads=self._experiment.keys.engine.threads or 1,
        )
        try:
            simulation = _emulator.Simulation(spec)
        except _emulator.EngineError as error:
            raise InputError(f"{self._experiment.origin.source}: {error}") from None
        places = EventPlaces(self._experiment, self._debug_files)
        self._told = EnvironmentMemory()
        self._environments: list[EmulatedEnvironment] = []
        if self._experiment.environment is not None:
            self._environments = [EmulatedEnvironment(self._experiment, simulation)]
            self._environments[0].keep(self._told)
        self._heard = GridMemory(self._experiment)
        self._hosts: list[EmulatedHost] = []
        if modules is not None:
            self._hosts = [EmulatedHost(simulation, self._experiment, places, self._heard)]
        self._table: EmulatedWorld | None = EmulatedWorld(simulation, places, self._hosts)
        self._views: list[WorldView] = []
        if view:
            orders = [host.order for host in self._hosts]
            grid = next(iter(orders), no_grid)
            self._views = [WorldView(self._experiment, simulation, grid)]
        self._companions: list[Companion] = [
            Steps(self._experiment, simulation),
            *self._hosts,
            *self._environments,
            Each(self._note_time),
            FasterCode(expected(self._experiment, guests)),
            *self._views,
        ]
        if simulation.tick < 0:
            self._go_on_to(0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Frees the robots' memory; the world cannot be used afterwards."""
        for host in self._hosts:
            host.leave()
        for shown in self._views:
            shown.close()
        self._optimiser.close()
        self._table = None
        self._hosts, self._views, self._companions = [], [], []

    @property
    def view_address(self) -> str | None:
        """The address of the page that shows it; None without `view=True`."""
        return next((shown.address for shown in self._views), None)

    def _repr_html_(self) -> str | None:
        """The page, for a notebook on this computer."""
        style = "width: 100%; height: 640px; border: 0"
        pages = (f'<iframe src="{one.address}" style="{style}"></iframe>' for one in self._views)
        return next(pages, None)

    @property
    def _world(self) -> EmulatedWorld:
        if self._table is None:
            raise RunError(_CLOSED)
        return self._table

    @property
    def _simulation(self) -> _emulator.Simulation:
        return self._world.simulation

    # Going on.

    def run(self, for_s: Real) -> None:
        """Lets so many simulated seconds pass, 0 to 1e9, to the end of a world step."""
        duration_s = _checked(for_s=for_s).for_s
        # At least one tick, so that a caller that waits in small steps gets on.
        self.run_ticks(max(ticks(duration_s), 1 if duration_s else 0))

    def run_ticks(self, count: Whole) -> None:
        """Lets so many nominal ticks of 32.768 ms pass, to the end of a world step.

        Ctrl-C ends it within a moment.
        """
        self._go_on_to(self.tick + _checked(count=count).count)

    def _go_on_to(self, end: int) -> None:
        world = self._world
        world.end = end
        for host in self._hosts:
            host.notice_orders()
        self._went_on_s = time.perf_counter()
        Session(world, [Attention(_CHUNK_S), *self._companions]).run()
        self._note_time()

    def _note_time(self) -> None:
        """Lets the optimiser know how long the world has run: it may go on for as long."""
        now_s = time.perf_counter()
        self._ran_s += now_s - self._went_on_s
        self._went_on_s = now_s
        self._optimiser.note(self._ran_s, self._ran_s)

    @property
    def tick(self) -> int:
        """Nominal ticks since the begin."""
        return self._simulation.tick

    @property
    def time_s(self) -> float:
        """Simulated seconds since the begin."""
        return seconds(self.tick)

    # Looking.

    @property
    def size(self) -> int:
        """How many robots there are."""
        return self._simulation.robots

    @property
    def poses(self) -> NDArray[np.float32]:
        """[robots, 3]: x_m, y_m, heading_rad."""
        now = self._simulation.snapshot()
        return np.stack([now["x_m"][0], now["y_m"][0], now["heading_rad"][0]], axis=1)

    @property
    def objects(self) -> NDArray[np.float32]:
        """[objects, 3]: x_m, y_m, heading_rad of each [[object]], in the order of the file."""
        now = self._simulation.snapshot()
        columns = now["object_x_m"][0], now["object_y_m"][0], now["object_heading_rad"][0]
        return np.stack(columns, axis=1)

    @property
    def leds(self) -> NDArray[np.uint8]:
        """[robots] uint8: the LEDs, as RGB(r, g, b) encodes them."""
        led = self._simulation.snapshot()["led"][0]
        shown: NDArray[np.uint8] = np.bitwise_and(led, LED_VALUES - 1, dtype=np.uint8)
        return shown

    @property
    def motors(self) -> NDArray[np.uint8]:
        """[robots, 2]: duties of the left and the right motor."""
        return self._simulation.motors()

    @property
    def frames(self) -> NDArray[np.uint32]:
        """[robots, 2]: frames sent and received so far."""
        return self._simulation.frames()

    @property
    def states(self) -> list[str]:
        """The state of each robot by [states]; "RGB(r,g,b)" of an LED colour without a name."""
        return [self._names.names[index] for index in self._names.of_robots(self.leds)]

    @property
    def events(self) -> list[dict[str, Any]]:
        """All that happened to robots so far: what they printed, and what went wrong.

        A dict each: `tick`, `robot_tick`, `robot`, `program`, `kind` (print, note, busy_wait,
        endless, crash, stack_overflow), `text`; `file`, `line` and `function` of the program's
        sources where they are known.
        """
        self._events += self._world.robot_events()
        return list(self._events)

    def prints(self, robot: Whole) -> str:
        """All that a robot has printed so far."""
        index = self._robot(robot)
        return "".join(
            event["text"]
            for event in self.events
            if event["kind"] == "print" and event["robot"] == index
        )

    @property
    def metrics(self) -> dict[str, float | None]:
        """The experiment's [metric]s now, by name; None of what has no value.

        Those that look back (coverage, message_rate, first_time) look back at earlier calls.
        KilotwinError says where a function of yours failed.
        """
        now = self._simulation.snapshot()
        stopped = {event["robot"] for event in self.events if event["kind"] in FAILURES}
        moment = Moment(self._simulation, len(stopped), self._experiment.modules is not None)
        self._meter.measure(now, moment, last=True)
        for name, why in self._meter.failed.items():
            raise RunError(f"metric {name}: {why}")
        return dict(self._meter.latest)

    @property
    def stats(self) -> dict[str, int | float]:
        """Counts of frames, contacts and so on."""
        return self._simulation.stats()

    @property
    def result_hash(self) -> str:
        """16 hex digits: equal for worlds that did the same at every sample, print and frame."""
        return self._simulation.result_hash()

    @property
    def final_hash(self) -> str:
        """16 hex digits: equal for worlds whose robots stand and shine alike now."""
        return self._simulation.final_hash()

    def variable(self, robot: Whole, name: str) -> Any:
        """The value of a global or static variable of a robot's program. For tests.

        Where several have the name: "file.c:name" or "function:name". Structures come as dicts,
        arrays as lists, pointers and enums as numbers. Those of a robot on an ATmega328P are not
        read.
        """
        index, wanted = self._robot(robot), _checked(name=name).name
        group = self._experiment.group_index(index)
        file = self._debug_files[group]
        if file is None or self._experiment.groups[group].on_board:
            raise InputError(
                f"World: robot {index} runs on its ATmega328P, whose variables are not read; let "
                "it print them, or leave its cpu out"
            )
        if file not in self._symbols:
            self._symbols[file] = GuestSymbols(file)
        return self._symbols[file].read(self._simulation.state(index), wanted)

    def _robot(self, index: Whole) -> int:
        """`index`, if there is such a robot."""
        robot, size = _checked(robot=index).robot, self.size
        if not 0 <= robot < size:
            raise InputError(f"World: there is no robot {robot}; the robots are 0 to {size - 1}")
        return robot

    # A Kilogrid below the robots, if the experiment has one.

    @property
    def host(self) -> Controller:
        """The grid's host, for orders: `pause()`, `resume()`, `change({(x, y): bytes, ...})`.

        It has set modules and robots up by the time 0, sends RUN then, and polls for reports.
        """
        return self._grid.conductor.controller

    @property
    def reports(self) -> list[dict[str, Any]]:
        """Reports of robots through cells that the host has fetched so far, a dict per report.

        `time_s` is the host's; `robot` is -1 for one that is not in the experiment; `module_x`,
        `module_y`, `cell` are where; `data` are the seven bytes.
        """
        return self._grid_memory().rows()

    @property
    def grid_events(self) -> list[dict[str, Any]]:
        """Events of the host and of modules' programs: `time_s`, `kind`, `text`."""
        return sorted(self._grid_memory().happened, key=lambda event: float(event["time_s"]))

    @property
    def cells(self) -> NDArray[np.uint8]:
        """Lights of cells, lower left first: [2 * rows, 2 * columns, 2], colour and brightness.

        A colour is 1 for red, 2 for green, 4 for blue, or their sum.
        """
        return self._grid.simulation.cells()

    @property
    def modules(self) -> list["_emulator.ModuleRecord"]:
        """State, ticks and error counters of each module."""
        return self._grid.simulation.modules()

    def _grid_memory(self) -> GridMemory:
        self._grid.module_events()
        return self._heard

    @property
    def _grid(self) -> EmulatedHost:
        if self._experiment.modules is None:
            raise InputError(
                "there is no grid; give World a [grid]: grid={'columns': 4, 'rows': 4}"
            )
        if not self._hosts:
            raise RunError(_CLOSED)
        return self._hosts[0]

    # A virtual environment, if the experiment has one.

    @property
    def environment(self) -> Any:
        """The object of the class that `[environment] program` names, for a look at it."""
        if not self._environments:
            what = 'environment={"program": "pheromone.py:Pheromone"}'
            raise InputError(f"there is no environment; give World an [environment]: {what}")
        return self._environments[0].play.program.object

    @property
    def sent(self) -> list[dict[str, Any]]:
        """Words that the environment told robots so far, a dict each: `time_s` when the overhead
        controller had it, `asked_s`, `uid`, `type`, `value`; `data` in a message for all."""
        return list(self._told.rows)

    # Talking, from outside the robots' own infrared.

    def send(
        self,
        data: Iterable[Whole] = (),
        type: Whole = 0,
        *,
        robot: Whole | None = None,
        within: Sequence[Real] | NDArray[Any] | None = None,
    ) -> None:
        """A message to all robots, to one, or to those `within` (x_m, y_m, radius_m).

        Up to nine bytes, filled up with zeros. Types from 0x80 up are system commands.
        """
        given = _checked(data=data, type=type, within=within)
        to = ALL_ROBOTS if robot is None else (self._experiment.uid_of(self._robot(robot)),) * 2
        where: Region | None = None
        if given.within is not None:
            x, y, radius = given.within
            where = x, y, radius
        self._simulation.send(message(given.data, given.type), *to, where)

    def command(self, send: str, **keys: Any) -> None:
        """Sends what a [[command]] of an experiment does, now: `command("pause", robot=3)`."""
        for key in ("at_s", "repeat_s"):
            if key in keys:
                raise InputError(f"World: a command acts now, and once; remove '{key}'")
        if keys.get("robot") is not None:
            keys["robot"] = self._experiment.uid_of(self._robot(keys["robot"]))
        origin = _origin({"command": [{"at_s": 0, "send": send, **keys}]}, [])
        command = one_command(origin, self._experiment.uids)
        profile = PROFILES[self._experiment.keys.swarm.profile]
        to = uids(command)
        self._simulation.send(message_of(command, profile), *to, region(command))


def _beside() -> Path:
    """The folder of the Python file that asks for a world; the current one in a notebook."""
    frame = inspect.currentframe()
    while frame is not None and frame.f_globals.get("__name__", "").startswith("kilotwin."):
        frame = frame.f_back
    file = None if frame is None else Path(frame.f_code.co_filename)
    return file.resolve().parent if file is not None and file.is_file() else Path.cwd()


def experiment_for(
    file: str | None, keys: Mapping[str, Any], settings: list[Setting], to: str = "World"
) -> Experiment:
    """The experiment of a file, beside which `to` takes no keys, or without one of the keys."""
    if file is None:
        return experiment_of(keys, settings, to)
    key = key_of(Path(file))
    if key is not None:
        what = f"{to}: {file} is a robot's program, not an experiment file"
        raise InputError(f'{what}; type {to}({key}="{file}")')
    if keys:
        raise InputError(f"{to}: '{next(iter(keys))}' goes without a file; use set=[...]")
    beside = _beside() / file
    there = beside.exists() and not Path(file).exists()
    return Experiment.load(beside if there else Path(file), settings)


def experiment_of(
    keys: Mapping[str, Any], settings: list[Setting], to: str = "World"
) -> Experiment:
    """An experiment without a file; keys as `World` takes them."""
    tables = plain(keys)
    tables.setdefault("name", "world")
    tables.setdefault("duration_s", _LONGEST_S)  # as long as it is stepped
    if "arena" in tables or "grid" not in tables:
        tables["arena"] = _arena(tables.get("arena", [1.0, 1.0]), to)
    swarm = tables.setdefault("swarm", {})
    profile = tables.pop("profile", "kilobot")
    if isinstance(swarm, dict):
        swarm.setdefault("profile", profile)
    kind = {key: tables.pop(key) for key in Robots.model_fields if key in tables}
    if kind and "robots" in tables:
        raise InputError(f"{to}: '{next(iter(kind))}' goes without robots=; write it in there")
    if kind:
        poses = kind.get("poses")
        if kind.get("count") is None and not isinstance(poses, str):
            kind["count"] = len(poses) if isinstance(poses, list) else 1
        tables["robots"] = [kind]
    return Experiment.of(_origin(tables, settings, to))


def _arena(given: Any, to: str) -> Any:
    """An [arena] of what `World` takes for one."""
    if isinstance(given, int | float):
        return {"diameter_m": given}
    if isinstance(given, list) and len(given) == 2:
        return {"shape": "rectangle", "width_m": given[0], "height_m": given[1]}
    if isinstance(given, list) and len(given) > 2 and isinstance(given[0], list):
        return {"shape": "polygon", "points_m": given}
    if not isinstance(given, dict):
        what = (
            "(width, height) in metres, a diameter, a polygon's corners, or a dict with the keys "
            "of [arena]"
        )
        raise InputError(f"{to}: arena is {given!r}; it must be {what}")
    return given


def _origin(
    tables: dict[str, Any], settings: list[Setting], source: str = "World"
) -> ExperimentText:
    return ExperimentText(source, _beside(), plain(tables), "", settings)


def plain(value: Any) -> Any:
    """As TOML would have it: lists, Python's own numbers, text."""
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Iterable) and not isinstance(value, str):
        return [plain(item) for item in value]
    return value
