"""Writes what was measured into a lab's file, whole or not at all, and keeps all else in it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import tomlkit
from tomlkit.items import AbstractTable

from kilotwin.errors import InputError, cause_of
from kilotwin.experiment.lab_file import Lab, LabRobot, parse_lab, read_lab
from kilotwin.experiment.toml_lines import line_of, locate
from kilotwin.files.drafts import draft_of


@dataclass(frozen=True)
class Entry:
    """A robot as measured: keys of [robot.N], the key that says how, and how."""

    uid: int
    values: Mapping[str, int | Sequence[int]]
    what: str
    """`motors` or `ranging`."""
    how: str


def lab_of(file: Path) -> Lab:
    """The file's lab; one without robots if there is no such file yet."""
    return read_lab(file) if file.exists() else Lab(str(file), {})


def store(file: Path, entries: Sequence[Entry], now: datetime) -> Lab:
    """Puts the entries into the file as it is on the disk now; gives what it then holds.

    Comments, other robots and keys stay. InputError if the file has mistakes, or cannot be written;
    then it is as it was.
    """
    text = file.read_bytes().decode() if file.exists() else ""
    parse_lab(text, file)
    document = tomlkit.parse(text)
    robots = document.setdefault("robot", tomlkit.table(is_super_table=True))
    for entry in entries:
        robot = robots.setdefault(str(entry.uid), tomlkit.table())
        if not isinstance(robot, AbstractTable):
            line = line_of(locate(text), ("robot", str(entry.uid)))
            raise InputError(f"{file}:{line}: write this robot as [robot.{entry.uid}]")
        for key, value in entry.values.items():
            robot[key] = list(value) if isinstance(value, Sequence) else value
        measured = tomlkit.inline_table()
        measured.update({"at": now.replace(microsecond=0), "how": entry.how})
        robot[entry.what] = measured
    return _write(file, tomlkit.dumps(document))


def rename(file: Path, uid: int, new_uid: int) -> Lab:
    """Gives a robot another uid; one that the file does not know is added.

    InputError if another robot has it, or if the file cannot be written.
    """
    lab = lab_of(file)
    if new_uid in lab.robots and new_uid != uid:
        line = line_of(locate(file.read_text()), ("robot", str(new_uid)))
        raise InputError(f"{file}:{line}: there is a robot {new_uid} already; take a free uid")
    document = tomlkit.parse(file.read_text() if file.exists() else "")
    robots = document.setdefault("robot", tomlkit.table(is_super_table=True))
    robots[str(new_uid)] = robots.pop(str(uid), tomlkit.table())
    return _write(file, tomlkit.dumps(document))


def _write(file: Path, text: str) -> Lab:
    lab = parse_lab(text, file)
    try:
        with draft_of(file) as draft:
            draft.write_text(text)
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"{file}: {reason}; name a lab's file that can be written") from None
    return lab


def duties_of(robot: LabRobot | None, otherwise: Mapping[str, int]) -> dict[str, int]:
    """A robot's four duties; `otherwise` has those that its lab does not know."""
    known = {} if robot is None else robot.model_dump(exclude_none=True)
    return {key: known.get(key, duty) for key, duty in otherwise.items()}
