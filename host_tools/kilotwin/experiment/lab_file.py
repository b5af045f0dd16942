"""A lab's robots, `lab.toml`: what is in each robot's EEPROM, and how it was measured.

    [robot.12]                      # by uid
    turn_left = 65                  # duties, 0 to 255
    turn_right = 66
    straight_left = 70
    straight_right = 71
    low_gain = [900, 737, ...]      # 14 readings from contact (33 mm) on, 5 mm apart
    high_gain = [1023, 1023, ...]
    motors = { at = 2026-11-24T12:00:00, how = "by hand, ohc:/dev/ttyUSB0" }

Written by `table/lab/lab_store.py`.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, ValidationError

from kilotwin.errors import InputError
from kilotwin.experiment.schema.section import LAST_UID, Byte, Section, Text
from kilotwin.experiment.text import ExperimentText, parse_toml
from kilotwin.experiment.toml_lines import KeyPath
from kilotwin.experiment.validation_errors import input_error
from kilotwin.files.headers import GAIN_DISTANCES_MM

TABLES = ("low_gain", "high_gain")

_Reading = Annotated[int, Field(ge=0, le=1023)]
# kilolib/core/gains.h
_Gains = Annotated[list[_Reading], Field(min_length=14, max_length=14)]


class Measured(Section):
    """When and how something was measured."""

    at: datetime | date
    """When."""
    how: Text
    """How: by hand or on a grid, and by which way."""


class LabRobot(Section):
    """One robot as measured. Duties left out are those of its kind."""

    turn_left: Byte | None = None
    """Duty of the left motor in a left turn."""
    turn_right: Byte | None = None
    """Duty of the right motor in a right turn."""
    straight_left: Byte | None = None
    """Duty of the left motor straight on."""
    straight_right: Byte | None = None
    """Duty of the right motor straight on."""
    low_gain: _Gains | None = None
    """Readings of the low gain at 33, 38 ... 98 mm; they fall."""
    high_gain: _Gains | None = None
    """The same of the high gain."""
    motors: Measured | None = None
    """How and when the duties were measured."""
    ranging: Measured | None = None
    """How and when the gains were measured."""


class LabSchema(Section):
    """A whole file."""

    robot: dict[str, LabRobot] = Field(default={})
    """By uid."""


@dataclass(frozen=True)
class Lab:
    """A lab's robots by uid, in order of their uids."""

    source: str
    robots: dict[int, LabRobot]


def read_lab(file: Path) -> Lab:
    """Reads and checks; InputError names file and line."""
    try:
        text = file.read_bytes().decode()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: cannot be read ({error}); name a lab's TOML file") from None
    return parse_lab(text, file)


def parse_lab(text: str, file: Path) -> Lab:
    """The same, of a text that stands or will stand in `file`."""
    raw = parse_toml(file, text)
    origin = ExperimentText(str(file), file.parent, raw, text, [])
    try:
        keys = LabSchema.model_validate(raw)
    except ValidationError as error:
        raise input_error(origin, error, schema=LabSchema) from None
    for path, what in _problems(keys):
        raise InputError(f"{origin.where(path)}: {what}")
    robots = {int(uid): robot for uid, robot in keys.robot.items()}
    return Lab(str(file), dict(sorted(robots.items())))


def with_gains(robot: LabRobot, measured: Sequence[Sequence[float]]) -> LabRobot:
    """The robot, with tables between readings of others where it has none of its own.

    `measured`: distance in mm, centre to centre, low and high gain, with rising distances. Nearer
    than the first and farther than the last the readings are as there.
    """
    if robot.low_gain is not None:
        return robot
    at, *tables = np.array(measured, np.float64).T
    low, high = (
        np.rint(np.interp(GAIN_DISTANCES_MM, at, table)).astype(int).tolist() for table in tables
    )
    return robot.model_copy(update={"low_gain": low, "high_gain": high})


def _problems(keys: LabSchema) -> Iterator[tuple[KeyPath, str]]:
    for uid, robot in keys.robot.items():
        path: KeyPath = ("robot", uid)
        if not uid.isascii() or not uid.isdigit() or str(int(uid)) != uid or int(uid) > LAST_UID:
            yield path, f"'{uid}' is no uid; write [robot.N] with N from 0 to {LAST_UID}"
        for key, other in (TABLES, TABLES[::-1]):
            if getattr(robot, key) is not None and getattr(robot, other) is None:
                what = f"'{key}' needs '{other}' beside it; add {other} = [14 readings]"
                yield (*path, key), what
        for key in TABLES:
            readings = getattr(robot, key) or []
            for index, (near, far) in enumerate(itertools.pairwise(readings), 1):
                if far > near:
                    what = f"{key} rises from {near} to {far}; readings fall with the distance"
                    yield (*path, key, index), what
