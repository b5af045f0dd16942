"""Compilers under confinement: they read a program's own folders, our headers and the system's.

What a program may include is what its compiler may read; so a header that names another file of
the user gives an error, and no part of that file.
"""

import contextlib
import importlib.util
import itertools
import re
import stat
import tempfile
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

from kilotwin.errors import RunError
from kilotwin.files import confinement, resources
from kilotwin.files.places import PARCEL

HELPER = Path(__file__).resolve().parents[1] / "kilotwin_confined"
CANNOT_START = 125
"""Exit code of the helper when it does not start the compiler."""

_SYSTEM = ("/usr", "/lib", "/lib32", "/lib64", "/bin", "/opt", "/nix/store", "/gnu/store")
_LOADER_CACHE = "/etc/ld.so.cache"
_SOURCES = {".c", ".h", ".inc", ".S", ".s"}
# Folders this near the root hold more than one program.
_SHALLOW = 3
_NAMED_WITHIN = re.compile(r"[=,](/[^,]+)")


def confined(command: Sequence[str]) -> list[str]:
    """The command of a compiler as the helper starts it: it reads what its words name, and writes
    in the folder of its -o.

    As it is if programs are trusted. RunError if it must be confined and cannot.
    """
    mode = confinement.mode()
    if mode == "off":
        return list(command)
    helper = _helper()
    if helper is None:
        if mode == "require":
            raise RunError(f"--confine=require: {HELPER} is not here; install kilotwin again")
        return list(command)
    words = [helper, *(["--require"] if mode == "require" else [])]
    for folder in (*_SYSTEM, *_prefix(command[0])):
        words += ["--execute", folder]
    for path in dict.fromkeys([_LOADER_CACHE, *_read_by(command)]):
        words += ["--read", path]
    for path in ["/dev/null", *_written_by(command)]:
        words += ["--write", path]
    return [*words, "--", *command]


def scratch_of(command: Sequence[str]) -> str:
    """Where it may keep what it needs in between."""
    return next(_written_by(command), tempfile.gettempdir())


@cache
def _helper() -> str | None:
    found = next((path for path in _helpers() if path.is_file()), None)
    return None if found is None else str(found)


def _helpers() -> Iterator[Path]:
    yield HELPER
    # An editable install keeps what is compiled apart from the sources.
    engine = importlib.util.find_spec("kilotwin._emulator")
    if engine is not None and engine.origin is not None:
        yield Path(engine.origin).with_name(HELPER.name)


def _prefix(compiler: str) -> Iterator[str]:
    """A compiler's own file, and the folder that one elsewhere is installed in."""
    yield compiler
    prefix = Path(compiler).resolve().parent.parent
    if len(prefix.parts) > _SHALLOW and not str(prefix).startswith(_SYSTEM):
        yield str(prefix)


def _read_by(command: Sequence[str]) -> Iterator[str]:
    yield from map(str, resources.build_folders())
    for word in command[1:]:
        if word.startswith("-I"):
            yield from _sources_of(Path(word[2:]))
            continue
        inner = _NAMED_WITHIN.search(word)
        path = Path(inner[1] if inner else word)
        if (word.startswith("-") and not inner) or not path.exists():
            continue
        if path.suffix in _SOURCES:
            for folder in program_folders(path):
                yield from _sources_of(folder)
        else:
            yield str(path)


def _sources_of(folder: Path) -> Iterator[str]:
    """The folder; where it has a user's files, or those of all users as /tmp has them, the sources
    and headers that lie in it."""
    folder = folder.resolve()
    if not folder.is_dir():
        return
    if not (Path.home().is_relative_to(folder) or folder.stat().st_mode & stat.S_ISVTX):
        yield str(folder)
        return
    with contextlib.suppress(PermissionError):
        yield from (str(file) for file in folder.iterdir() if file.suffix in _SOURCES)


def program_folders(source: Path) -> Iterator[Path]:
    """Folders that belong to the program of a source: its own, the one that holds that, and its
    checkout, or the parcel of the run folder that keeps it; but, of these, none that holds the
    files of a user, or of all."""
    home = Path.home()
    folder = source.resolve().parent
    yield folder
    for ancestor in folder.parents:
        if len(ancestor.parts) <= _SHALLOW or home.is_relative_to(ancestor):
            return
        whole = ancestor.name == PARCEL or (ancestor / ".git").exists()
        if whole or ancestor == folder.parent:
            yield ancestor


def _written_by(command: Sequence[str]) -> Iterator[str]:
    for option, path in itertools.pairwise(command):
        if option == "-o":
            yield str(Path(path).absolute().parent)
