"""An experiment, read, checked and complete: every default filled in, every program found.

`Experiment.load` is the way in for a file, `Experiment.from_resolved` for what `resolved()` gave.
"""

import hashlib
import itertools
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit
from pydantic import ValidationError

from kilotwin.errors import InputError
from kilotwin.experiment_checks import first_problem, swarm_size
from kilotwin.experiment_errors import input_error
from kilotwin.experiment_schema import ExperimentSchema
from kilotwin.experiment_text import ExperimentText, Setting
from kilotwin.programs import Program, find_program
from kilotwin.toml_lines import KeyPath


@dataclass(frozen=True)
class Group:
    """Robots that run one program; ids are given group by group."""

    program: Program
    count: int
    poses: list[list[float]] | None


@dataclass(frozen=True)
class Experiment:
    """`keys` are the file's, validated; `origin` says where a key was written, for late errors."""

    keys: ExperimentSchema
    groups: tuple[Group, ...]
    origin: ExperimentText

    @staticmethod
    def load(file: Path, settings: Iterable[Setting] = ()) -> "Experiment":
        """Reads, applies the settings, then checks everything; InputError names the place."""
        origin = ExperimentText(file, list(settings))
        origin.raw.setdefault("name", file.stem)
        try:
            keys = ExperimentSchema.model_validate(origin.raw)
        except ValidationError as error:
            raise input_error(origin, error) from None
        problem = first_problem(keys)
        if problem is not None:
            raise InputError(f"{origin.where(*problem.paths)}: {problem.what}")
        return Experiment(keys, tuple(_groups(keys, origin)), origin)

    @property
    def size(self) -> int:
        """The number of robots."""
        return swarm_size(self.keys)

    def program_of(self, robot: int) -> Program:
        """What the robot of that id runs."""
        ends = itertools.accumulate(group.count for group in self.groups)
        return next(
            group.program for group, end in zip(self.groups, ends, strict=True) if robot < end
        )

    def resolved(self) -> dict[str, Any]:
        """Every key with its value, as plain tables that TOML can hold; loads to the same."""
        tables = self.keys.model_dump(exclude_none=True)
        written = [group.program.written for group in self.groups]
        if self.keys.robots is None:
            tables["swarm"]["program"] = written[0]
        else:
            for table, program in zip(tables["robots"], written, strict=True):
                table["program"] = program
        return tables

    def identity(self) -> str:
        """SHA-256 of the resolved keys: equal for experiments that mean the same."""
        canonical = json.dumps(self.resolved(), sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(canonical.encode()).hexdigest()

    def to_toml(self) -> str:
        """The resolved experiment as a file that `kilotwin run` takes."""
        return tomlkit.dumps(self.resolved())

    def error(self, path: KeyPath, what: str) -> InputError:
        """An error about a key that only the build or the engine could find."""
        return InputError(f"{self.origin.where(path)}: {what}")


def _groups(keys: ExperimentSchema, origin: ExperimentText) -> Iterable[Group]:
    if keys.robots is None:
        assert keys.swarm.program is not None
        assert keys.swarm.size is not None
        program = _program(keys.swarm.program, ("swarm", "program"), origin)
        yield Group(program, keys.swarm.size, None)
    for index, robots in enumerate(keys.robots or []):
        program = _program(robots.program, ("robots", index, "program"), origin)
        yield Group(program, robots.count, robots.poses)


def _program(written: str, path: KeyPath, origin: ExperimentText) -> Program:
    try:
        return find_program(written, origin.file.parent)
    except ValueError as error:
        raise InputError(f"{origin.where(path)}: {error}") from None
