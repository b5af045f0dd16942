"""Copies of what a run was made of, in its folder: its programs and their headers, Python of
metrics and environments, wire files, pictures. The run can be repeated from there on any machine,
whatever becomes of the originals (`kilotwin run --verify`).

Files lie below `parcel/` as they lie to one another, and experiment.toml names them there. What
comes with Kilotwin is below `parcel/kilotwin/`; its headers and runtimes are not kept, since the
manifest names its version.
"""

import hashlib
import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.programs import Program
from kilotwin.experiment.toml_text import toml_of
from kilotwin.files import resources
from kilotwin.files.places import OURS, PARCEL
from kilotwin.programs.confined_tools import program_folders
from kilotwin.programs.includes import files_read

# Keys whose texts name files or folders; those of Python end in `:name`.
_FILES = {"program", "hex", "include", "wire", "lab", "image", "configuration", "kilobot_ids"}
_PYTHON = {"function", "program"}
# Files of a program's folders that are kept where its text does not show its #includes.
_C_FILES = {".c", ".h", ".inc", ".def", ".s", ".S"}
_MOST_C_FILES = 500


@dataclass(frozen=True)
class Parcel:
    """`files`: where each lies in the run folder, by its path. `experiment`: as the folder keeps
    it."""

    files: dict[Path, str]
    experiment: str

    def copy_to(self, folder: Path) -> None:
        """OSError if a file is gone, or cannot be written."""
        for path, name in self.files.items():
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)


def parcel_of(experiment: Experiment) -> Parcel:
    """All that is needed to repeat a run of it; nothing with `record.sources = false`."""
    tables = experiment.resolved()
    if experiment.keys.record.sources is False:
        return Parcel({}, toml_of(tables))
    named: set[Path] = set()

    def note(path: Path) -> str:
        named.add(path)
        return ""

    _with_files(tables, note)
    files = {path for path in named if path.is_file()}
    for program in programs_of(experiment):
        files |= _files_of(program)
    for python in filter(None, (experiment.environment, *experiment.functions.values())):
        files |= {python.file, *python.file.parent.glob("*.py")}
    name_of = _naming(named | files)
    return Parcel(
        {path: name_of(path) for path in sorted(files)}, toml_of(_with_files(tables, name_of))
    )


def digest_of(program: Program) -> str:
    """SHA-256 of what its files hold, wherever they are."""
    digests = (hashlib.sha256(path.read_bytes()).digest() for path in sorted(_files_of(program)))
    return hashlib.sha256(b"".join(digests)).hexdigest()


def programs_of(experiment: Experiment) -> Iterator[Program]:
    """The programs of each kind of robots, then of modules."""
    for group in (*experiment.groups, experiment.modules):
        if group is not None:
            yield group.program


def _files_of(program: Program) -> set[Path]:
    """Its sources and headers, or its image."""
    if not program.sources:
        return {program.path}
    around = {*program.include_folders, *(source.parent for source in program.sources)}
    # Headers may lie wherever the compiler may read, as in the program's checkout.
    above = {
        *around,
        *(folder.parent for folder in around),
        *(folder for source in program.sources for folder in program_folders(source)),
        *resources.roots(),
    }
    told = files_read(program.sources, [f"-I{folder}" for folder in sorted(above)])
    if told is not None:
        return {Path(os.path.normpath(path)) for path in told}
    found = (path for folder in sorted(around) for path in sorted(folder.rglob("*")))
    code = [path for path in found if path.suffix in _C_FILES and path.is_file()]
    return {*program.sources, *code[:_MOST_C_FILES]}


def _split(text: str) -> tuple[Path | None, str]:
    """The file or folder that a resolved text names, and what follows: `:name` of Python."""
    before, colon, name = text.rpartition(":")
    for written, rest in ((text, ""), (before, colon + name)):
        found = Path(written) if Path(written).is_absolute() else resources.find(written)
        if written and found is not None and found.exists():
            return found.resolve(), rest
    return None, text


def _naming(paths: set[Path]) -> Callable[[Path], str]:
    """Names in the run folder: as the paths lie to one another."""
    roots = [root.resolve() for root in resources.roots()]

    def root_of(path: Path) -> Path | None:
        return next((root for root in roots if path.is_relative_to(root)), None)

    others = [str(path.parent) for path in paths if root_of(path) is None]
    common = Path(os.path.commonpath(others)) if others else Path("/")

    def name_of(path: Path) -> str:
        root = root_of(path)
        below = PurePosixPath(PARCEL, *([OURS] if root else []))
        return str(below / path.relative_to(root or common).as_posix())

    return name_of


def _with_files(tables: Any, name_of: Callable[[Path], str], key: str = "") -> Any:
    """The tables with other names for the files and folders that they name."""
    if isinstance(tables, dict):
        return {name: _with_files(value, name_of, name) for name, value in tables.items()}
    if isinstance(tables, list):
        return [_with_files(value, name_of, key) for value in tables]
    if not isinstance(tables, str) or key not in _FILES | _PYTHON:
        return tables
    path, rest = _split(tables)
    return rest if path is None else name_of(path) + rest
