"""An experiment, read, checked and complete: every default filled in, every program found.

`Experiment.load` is the way in for a file, `Experiment.of` for tables from elsewhere.
"""

import functools
import hashlib
import itertools
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import ValidationError

from kilotwin.errors import InputError
from kilotwin.experiment.checks.experiment import (
    first_problem,
    first_problem_of_command,
    swarm_size,
    uids_of,
)
from kilotwin.experiment.checks.robots import uids_text
from kilotwin.experiment.files import find_file, shown
from kilotwin.experiment.formations import StartError, in_formation
from kilotwin.experiment.pictures import Picture, floor_picture, light_picture
from kilotwin.experiment.processor import processor_of
from kilotwin.experiment.programs import (
    Api,
    Program,
    ProgramError,
    Runtime,
    find_image,
    find_program,
    portable,
)
from kilotwin.experiment.python_code import PythonName, find_python
from kilotwin.experiment.schema.experiment import Command, ExperimentSchema, Robots
from kilotwin.experiment.schema.grid import Grid
from kilotwin.experiment.spec.informed import informed_ranges
from kilotwin.experiment.text import ExperimentText, Setting
from kilotwin.experiment.toml_lines import KeyPath
from kilotwin.experiment.toml_text import toml_of
from kilotwin.units import seconds, ticks

if TYPE_CHECKING:
    from kilotwin.experiment.lab_file import LabRobot
    from kilotwin.experiment.spec.grid_plan import GridPlan
    from kilotwin.experiment.wire_file import Wire
    from kilotwin.files.build_id import Target

# Tables by which an experiment and a sweep are told apart when one is given for the other.
_OF_EXPERIMENTS = {"swarm", "arena", "robots", "duration_s"}
_OF_SWEEPS = {"base", "block", "vary", "together", "each", "seeds"}


Tier = Literal["native", "translated", "chip", "interpreted"]
"""How a program is executed: its C as a guest; its machine code as one; on a board's chip, whose
code is translated, or interpreted. The engine has the same words (emulator/robots/tier.h)."""


@dataclass(frozen=True)
class Group:
    """Robots or modules that run one program; ids are given group by group."""

    program: Program  # without sources: an image
    count: int
    poses: list[list[float]] | None
    tier: Tier = "native"
    boot_loader: "Target | None" = None  # whose loader is in its flash, besides the program
    why_native: str = ""  # where that would be the rule
    is_chosen: bool = False  # its tier is, as the file leaves it to us

    def on_chip(self, keys: ExperimentSchema) -> "Group":
        """The same on an ATmega328P."""
        return replace(self, tier=_tier("avr", keys))

    @property
    def on_board(self) -> bool:
        """Whether each of them is an ATmega328P."""
        return self.tier in ("chip", "interpreted")


@dataclass(frozen=True)
class Experiment:
    """`keys` are the file's, validated; `origin` knows where a key was written, for late errors.

    `modules` are those of a grid, and `plan` is what its host does; None without. `lab` has the uid
    and the calibration of each robot, if it comes from a lab. `environment` is the program of an
    [environment]; `floor` has the numbers of sites that are drawn, `light` what a projector throws.
    `functions` are those of metrics, by the metric's name; `wire` has the parameters that
    swarm.wire declares, with their values.
    """

    keys: ExperimentSchema
    groups: tuple[Group, ...]
    origin: ExperimentText
    modules: Group | None = None
    plan: "GridPlan | None" = None
    lab: "tuple[tuple[int, LabRobot], ...]" = ()
    environment: PythonName | None = None
    floor: Picture | None = None
    light: Picture | None = None
    functions: dict[str, PythonName] = field(default_factory=dict)
    wire: "Wire | None" = None

    @staticmethod
    def load(file: Path, settings: Iterable[Setting] = ()) -> "Experiment":
        """Reads, applies the settings, then checks everything; InputError names the place."""
        return Experiment.of(ExperimentText.read(file, list(settings)))

    @staticmethod
    def of(origin: ExperimentText) -> "Experiment":
        """Checks everything; InputError names the place."""
        if not _OF_EXPERIMENTS & origin.raw.keys() and _OF_SWEEPS & origin.raw.keys():
            what = f"a sweep, not an experiment; type: kilotwin sweep {origin.source}"
            raise InputError(f"{origin.source}: {what}")
        try:
            keys = ExperimentSchema.model_validate(_with_poses(origin))
        except ValidationError as error:
            raise _explained(origin, error) from None
        wire = _wire(keys, origin)
        if wire is not None:
            keys = keys.model_copy(update={"parameters": wire.values})
        try:
            placed = in_formation(keys)
        except StartError as error:
            raise InputError(f"{origin.where(error.path)}: {error}") from None
        problem = first_problem(placed, origin.is_set)
        if problem is not None:
            raise InputError(f"{origin.where(*problem.paths)}: {problem.what}")
        groups, lab = tuple(_groups(placed, origin)), _lab(keys, origin)
        if keys.swarm.lab is not None:
            _check_named(keys, origin, [uid for uid, _ in lab])
        floor, light = floor_picture(keys, origin), light_picture(keys, origin)
        functions = _functions(keys, origin)
        if keys.grid is None:
            environment = _environment(keys, origin)
            return Experiment(
                keys, groups, origin, None, None, lab, environment, floor, light, functions, wire
            )
        modules = _modules(keys.grid, keys, origin)
        from kilotwin.experiment.spec.grid_plan import plan_of

        plan = plan_of(keys, origin, floor)
        return Experiment(
            keys, groups, origin, modules, plan, lab, None, floor, light, functions, wire
        )

    @property
    def size(self) -> int:
        """The number of robots."""
        return swarm_size(self.keys)

    def uid_of(self, robot: int) -> int:
        """The uid with which the robot with that index begins."""
        return self.lab[robot][0] if self.lab else robot + 1

    @property
    def uids(self) -> Sequence[int]:
        """Those with which the robots begin, in the order of their indices."""
        return [uid for uid, _ in self.lab] if self.lab else range(1, self.size + 1)

    def robot_of(self, uid: int) -> int | None:
        """The index of the robot that begins with that uid; None: there is none."""
        uids = self.uids
        return uids.index(uid) if uid in uids else None

    def robot_named(self, uid: int, option: str) -> int:
        """The same for a uid that was typed behind an option; InputError if there is none."""
        robot = self.robot_of(uid)
        if robot is None:
            uids = self.uids
            raise InputError(
                f"{option} {uid}: there is no such robot; name one of {min(uids)} to {max(uids)}"
            )
        return robot

    def group_index(self, robot: int) -> int:
        """The index of the group of the robot with that id."""
        ends = itertools.accumulate(group.count for group in self.groups)
        return next(index for index, end in enumerate(ends) if robot < end)

    def group_of(self, robot: int) -> Group:
        """The group of the robot with that id."""
        return self.groups[self.group_index(robot)]

    def program_of(self, robot: int) -> Program:
        """The program of the robot with that id."""
        return self.group_of(robot).program

    def notes(self) -> Iterator[str]:
        """Lines that a user reads before an emulated run of it begins."""
        yield from self.why_native()
        commands, record = self.keys.command, self.keys.record
        if (
            self.modules is None
            and commands is not None
            and not any(command.send == "run" for command in commands)
        ):
            yield 'no [[command]] has send = "run": setup() and loop() are never called'
        if ticks(record.sample_s) < self.keys.sample_ticks:
            yield (
                f"record.sample_s = {record.sample_s:g} is shorter than the world's step: a sample "
                f"comes every {seconds(self.keys.sample_ticks):.3f} s; for more of them set "
                f"engine.step_ticks = {min(ticks(record.sample_s), 2)}"
            )

    def why_native(self) -> Iterator[str]:
        """A line for each program that does not run as its robot's machine code, as is the rule."""
        reasons = {group.program.written: group.why_native for group in self.groups}
        for program, why in reasons.items():
            if why:
                yield f"{program} runs natively (docs/limits.md): {why}"

    def takes_whole_numbers(self, key: KeyPath) -> bool:
        """Whether a key, as ("swarm", "size"), takes no other numbers."""
        declared = {} if self.wire is None else self.wire.keys.parameter
        parameter = declared.get(str(key[-1])) if key[0] == "parameters" else None
        if parameter is not None:
            return parameter.kind == "whole"
        from kilotwin.experiment.validation_errors import is_whole_number

        return is_whole_number(key)

    def resolved(self) -> dict[str, Any]:
        """Every key with its value, as plain tables that TOML can hold; loads to the same."""
        tables = self.keys.model_dump(exclude_none=True)
        kinds = [tables["swarm"]] if self.keys.robots is None else tables["robots"]
        for table, group in zip(kinds, self.groups, strict=True):
            parts = list(group.program.parts)
            key = "program" if group.program.sources else "hex"
            self._resolve_cpu(table, group)
            table[key] = parts if len(parts) > 1 else parts[0]
            if "include" in table:
                table["include"] = list(group.program.includes)
        if self.keys.robots is not None:
            tables["swarm"].pop("cpu")
        if self.keys.swarm.lab is not None:
            found = find_file(self.keys.swarm.lab, ("swarm", "lab"), self.origin)
            tables["swarm"]["lab"] = portable(found)
        if self.wire is not None:
            tables["swarm"]["wire"] = portable(self.wire.file)
        if self.environment is not None:
            file = portable(self.environment.file)
            tables["environment"]["program"] = f"{file}:{self.environment.name}"
        for name, function in self.functions.items():
            written = f"{portable(function.file)}:{function.name}"
            tables["metric"][name]["function"] = written
        for key in ("metric", "expect", "step"):
            if not tables[key]:
                del tables[key]  # older run folders have none either
        if self.floor is not None:
            tables["floor"]["image"] = portable(self.floor.file)
        if self.light is not None:
            tables["light"]["picture"]["image"] = portable(self.light.file)
        if self.modules is not None:
            self._resolve_grid(tables["grid"], self.modules)
        return tables

    def _resolve_cpu(self, table: dict[str, Any], group: Group) -> None:
        """Writes what "auto" means for a Kilobot here: elsewhere it may be another processor."""
        if not group.program.sources:
            return
        cpu = table.pop("cpu", None) or self.keys.swarm.cpu
        if cpu != "auto":
            table["cpu"] = cpu
        elif self.keys.swarm.profile == "kilobot":
            table["cpu"] = "avr" if group.on_board else group.tier

    def _resolve_grid(self, table: dict[str, Any], modules: Group) -> None:
        if modules.program.sources:
            table["program"] = list(modules.program.parts)
            table["include"] = list(modules.program.includes)
        else:
            table["hex"] = modules.program.parts[0]
            for key in ("program", "include", "define"):
                del table[key]
        path: KeyPath = ("grid",)
        for place in (table, *table["change"]):
            for key in ("configuration", "kilobot_ids"):
                if key in place:
                    place[key] = portable(find_file(place[key], (*path, key), self.origin))

    def identity(self) -> str:
        """SHA-256 of the resolved keys: equal for experiments that mean the same. What is expected
        of a run, and hunted in it, changes nothing in it."""
        beside = ("expect", "hunt")
        keys = {key: value for key, value in self.resolved().items() if key not in beside}
        canonical = json.dumps(keys, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(canonical.encode()).hexdigest()

    def to_toml(self) -> str:
        """The resolved experiment as a file that `kilotwin run` takes."""
        return toml_of(self.resolved())

    def error(self, path: KeyPath, what: str) -> InputError:
        """An error about a key that only the build or the engine could find."""
        return InputError(f"{self.origin.where(path)}: {what}")


def one_command(origin: ExperimentText, robots: Sequence[int]) -> Command:
    """The one [[command]] of tables that hold nothing else, for robots with these uids."""
    try:
        command = Command.model_validate(origin.raw["command"][0])
    except ValidationError as error:
        raise _explained(origin, error, ("command", 0)) from None
    problem = first_problem_of_command(command, robots)
    if problem is not None:
        raise InputError(f"{origin.where(*problem.paths)}: {problem.what}")
    return command


def _with_poses(origin: ExperimentText) -> dict[str, Any]:
    """The tables, with the poses of files."""
    kinds = origin.raw.get("robots")
    if not isinstance(kinds, list) or not any(
        isinstance(kind, dict) and isinstance(kind.get("poses"), str) for kind in kinds
    ):
        return origin.raw
    from kilotwin.experiment.pose_files import with_poses

    return with_poses(kinds, origin)


def _check_named(keys: ExperimentSchema, origin: ExperimentText, uids: Sequence[int]) -> None:
    """InputError if a key names a robot that the lab does not have."""
    commands, steps = enumerate(keys.command or []), enumerate(keys.step)
    named = [(("command", index, "robot"), command.robot) for index, command in commands]
    named += [(("step", index, "robot"), step.robot) for index, step in steps]
    broken: list[tuple[KeyPath, int]] = [
        (("faults", "robot", index, "robots"), uid)
        for index, fault in enumerate(keys.faults.robot)
        for uid in fault.robots or ()
    ]
    for path, robot in [*named, *broken]:
        if robot is not None and robot not in uids:
            raise InputError(f"{origin.where(path)}: there is no robot {robot}; {uids_text(uids)}")


def _wire(keys: ExperimentSchema, origin: ExperimentText) -> "Wire | None":
    """The declaration of parameters, if there is one, with their values."""
    if keys.swarm.wire is None and keys.parameters is None:
        return None
    from kilotwin.experiment.wire_file import wire_of

    return wire_of(keys, origin)


def _explained(origin: ExperimentText, error: ValidationError, table: KeyPath = ()) -> InputError:
    """A broken rule of the schema as an error with its place."""
    from kilotwin.experiment.validation_errors import input_error

    return input_error(origin, error, table)


def _groups(keys: ExperimentSchema, origin: ExperimentText) -> Iterable[Group]:
    if keys.robots is None:
        assert keys.swarm.program is not None
        assert keys.swarm.size is not None
        program = _program(keys.swarm.program, ("swarm",), origin)
        program = replace(program, runtime=keys.swarm.runtime)
        cpu, why = processor_of(program, keys.swarm.cpu, keys.swarm.profile)
        chosen = keys.swarm.cpu == "auto"
        yield Group(program, keys.swarm.size, None, _tier(cpu, keys), None, why, chosen)
    for index, robots in enumerate(keys.robots or []):
        table = ("robots", index)
        if robots.hex is not None:
            program = _image(robots.hex, table, origin)
        else:
            assert robots.program is not None
            program = _program(
                robots.program, table, origin, robots.include, robots.define, api=robots.flavour
            )
            program = replace(program, runtime=_runtime(robots, keys), printf=robots.printf)
        cpu, why = "avr" if robots.hex is not None else robots.cpu or keys.swarm.cpu, ""
        if robots.hex is None:
            cpu, why = processor_of(program, cpu, keys.swarm.profile)
        loader: Target | None = "robot" if robots.boot_loader else None
        chosen = robots.hex is None and (robots.cpu or keys.swarm.cpu) == "auto"
        yield Group(program, robots.count, robots.poses, _tier(cpu, keys), loader, why, chosen)


def _environment(keys: ExperimentSchema, origin: ExperimentText) -> PythonName | None:
    if keys.environment is None:
        return None
    return find_python(keys.environment.program, ("environment", "program"), origin, "class")


def _functions(keys: ExperimentSchema, origin: ExperimentText) -> dict[str, PythonName]:
    """Those of metrics, by the metric's name."""
    return {
        name: find_python(metric.function, ("metric", name, "function"), origin, "function")
        for name, metric in keys.metric.items()
        if metric.function is not None
    }


def _runtime(robots: Robots, keys: ExperimentSchema) -> Runtime:
    """Our boot loader comes with our runtime."""
    return robots.runtime or ("kilotwin" if robots.boot_loader else keys.swarm.runtime)


def _tier(cpu: str | None, keys: ExperimentSchema) -> Tier:
    """The tier of robots or modules with that key `cpu`."""
    if cpu == "avr":
        return "interpreted" if keys.engine.avr_core == "interpreted" else "chip"
    return "translated" if cpu == "translated" else "native"


def _lab(keys: ExperimentSchema, origin: ExperimentText) -> "tuple[tuple[int, LabRobot], ...]":
    """Uid and calibration of each robot: by `uids`, else the lab's with the lowest ones; none
    where nothing is said of them."""
    uids, gains = uids_of(keys), keys.swarm.gains
    path: KeyPath = ("swarm", "lab")
    if (keys.swarm.lab, uids, gains) == (None, None, None):
        return ()
    from kilotwin.experiment.lab_file import LabRobot, read_lab, with_gains

    if keys.swarm.lab is not None:
        lab = read_lab(shown(find_file(keys.swarm.lab, path, origin)))
        chosen = list(lab.robots)[: swarm_size(keys)] if uids is None else uids
        if len(chosen) < swarm_size(keys):
            what = f"{lab.source} has {len(chosen)} robots, for {swarm_size(keys)}"
            raise InputError(f"{origin.where(path)}: {what}; take fewer robots")
        strange = next((uid for uid in chosen if uid not in lab.robots), None)
        if strange is not None:
            what = f"{lab.source} has no robot {strange}; name those that it has by uids"
            raise InputError(f"{origin.where(path)}: {what}")
        robots = tuple((uid, lab.robots[uid]) for uid in chosen)
        source = lab.source
    else:
        source, path = "[[robots]]", ("robots",)
        robots = tuple((uid, LabRobot()) for uid in uids or range(1, swarm_size(keys) + 1))
    if gains is not None:
        robots = tuple((uid, with_gains(robot, gains)) for uid, robot in robots)
    informed = max((first + count for _, first, count in informed_ranges(keys)), default=0)
    if any(uid != index for index, (uid, _) in enumerate(robots[:informed], 1)):
        what = f"informed robots need the uids 1 to {informed}, which {source} does not have"
        raise InputError(f"{origin.where(path)}: {what}; set swarm.informed = 0")
    return robots


def _modules(grid: Grid, keys: ExperimentSchema, origin: ExperimentText) -> Group:
    table = ("grid",)
    if grid.hex is not None:
        program = _image(grid.hex, table, origin)
    else:
        program = _program(grid.program, table, origin, grid.include, grid.define, api="module")
        program = replace(program, runtime=grid.runtime or "kilotwin")
    cpu = "avr" if grid.hex is not None else grid.cpu
    loader: Target | None = "module" if grid.boot_loader else None
    return Group(program, grid.columns * grid.rows, None, _tier(cpu, keys), loader)


def _image(written: str, table: KeyPath, origin: ExperimentText) -> Program:
    return _found(functools.partial(find_image, written, origin.folder), table, origin)


def _program(
    written: str | list[str],
    table: KeyPath,
    origin: ExperimentText,
    includes: Sequence[str] = (),
    defines: Sequence[str] = (),
    *,
    api: Api | None = None,
) -> Program:
    find = functools.partial(find_program, written, origin.folder, includes, defines, api)
    return _found(find, table, origin)


def _found(find: Callable[[], Program], table: KeyPath, origin: ExperimentText) -> Program:
    try:
        return find()
    except ProgramError as error:
        raise InputError(f"{origin.where((*table, error.key))}: {error}") from None
