"""An experiment as it was written: the TOML file, `--set` on top, and where each key stands."""

import re
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from kilotwin.errors import InputError, cause_of
from kilotwin.experiment.programs import key_of
from kilotwin.experiment.toml_hints import hint
from kilotwin.experiment.toml_lines import KeyPath, line_of, locate

_TOO_LONG = re.compile(r"[0-9_]{4301}")


@dataclass(frozen=True)
class Setting:
    """One key set from the command line; `written` is what the user typed, for messages."""

    keys: tuple[str, ...]
    value: Any
    written: str


def parse_setting(text: str) -> Setting:
    """`swarm.informed=0`: a dotted key and a TOML value; text needs no quotes."""
    key, equals, value = text.partition("=")
    written = f"--set {text}"
    keys = _parse_keys(key)
    if not equals or not keys:
        raise InputError(f"{written}: not of the form key=value; try --set swarm.informed=0")
    parsed = _parse_value(value.strip())
    if _beyond_64_bits(parsed) is not None:
        raise InputError(f"{written}: {_LARGE}")
    return Setting(keys, parsed, written)


def _parse_keys(text: str) -> tuple[str, ...]:
    try:
        table: Any = tomllib.loads(f"{text} = 0") if "\n" not in text else 0
    except (ValueError, RecursionError):
        return ()
    keys: list[str] = []
    while isinstance(table, dict) and len(table) == 1:
        ((key, table),) = table.items()
        keys.append(key)
    return tuple(keys)


def _parse_value(text: str) -> Any:
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return parsed["value"] if len(parsed) == 1 else text


class ExperimentText:
    """The raw tables with all settings applied; `where` names the origin of any key."""

    def __init__(
        self,
        source: str,
        folder: Path,
        raw: dict[str, Any],
        text: str,
        settings: list[Setting],
    ) -> None:
        """Keeps and changes `raw`, the tables of `text`; "" if they were never written down.

        `source` is its name in messages; paths start at `folder`.
        """
        self.source = source
        self.folder = folder
        self.raw = raw
        self._text = text
        self._set: list[tuple[KeyPath, str]] = [
            (_apply(self.raw, setting), setting.written) for setting in settings
        ]

    @staticmethod
    def read(file: Path, settings: list[Setting]) -> "ExperimentText":
        """Reads `file`; an unreadable or malformed one is an InputError with its line."""
        text = _read(file)
        raw = parse_toml(file, text)
        read = ExperimentText(str(file), file.parent, raw, text, settings)
        read.raw.setdefault("name", file.stem)
        return read

    @cached_property
    def _lines(self) -> dict[KeyPath, int]:
        """Wanted for errors only, and slow where a file has thousands of poses."""
        return locate(self._text)

    def is_set(self, key: KeyPath) -> bool:
        """Whether a setting gave this key, not the file."""
        return any(path == key for path, _ in self._set)

    def where(self, *paths: KeyPath) -> str:
        """`file:line` of the first of these keys, or the option that set one of them."""
        for key, written in reversed(self._set):
            if any(path[: len(key)] == key or key[: len(path)] == path for path in paths):
                return written
        line = line_of(self._lines, paths[0])
        return self.source if line is None else f"{self.source}:{line}"


def _read(file: Path) -> str:
    key = key_of(file)
    if key is not None and file.is_file():
        raise InputError(
            f"{file}: a robot's program, not an experiment; name a TOML file, with {key} = "
            f'"{file.name}" in its [[robots]]'
        )
    try:
        text = file.read_bytes().decode()
    except UnicodeDecodeError:
        raise InputError(f"{file}: not UTF-8 text; an experiment is a TOML file") from None
    except IsADirectoryError:
        raise InputError(f"{file}: {_folder(file)}") from None
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"{file}: {reason}; name an experiment's TOML file") from None
    if text.startswith("\ufeff"):
        raise InputError(
            f"{file}:1: begins with a byte order mark (BOM), which TOML does not have; save the "
            "file as UTF-8 without BOM"
        )
    return text


def _folder(folder: Path) -> str:
    """The command to type for a folder that was named in place of an experiment."""
    if (folder / "manifest.json").is_file():
        again = folder / "experiment.toml"
        return f"a run folder; to see it type: kilotwin view {folder}; again: kilotwin run {again}"
    inside = sorted(folder.glob("*.toml"))[:3]
    named = f", as {', '.join(map(str, inside))}" if inside else ""
    return f"a folder; name an experiment's TOML file{named}"


def parse_toml(file: Path, text: str) -> dict[str, Any]:
    """The tables of `text`, which was read from `file`; InputError names the line."""
    try:
        tables = tomllib.loads(text)
        path = _beyond_64_bits(tables)
    except tomllib.TOMLDecodeError as error:
        raise InputError(_syntax_message(file, text, error)) from None
    except RecursionError:
        raise InputError(f"{file}: nested too deep; tables have three levels") from None
    except ValueError:  # of int(), which takes 4,300 digits
        lines = enumerate(text.splitlines(), 1)
        line = next(number for number, line in lines if _TOO_LONG.search(line))
        what = "a number of more than 4,300 digits; write a shorter one"
        raise InputError(f"{file}:{line}: {what}") from None
    if path is not None:
        raise InputError(f"{file}:{line_of(locate(text), path)}: {_LARGE}")
    return tables


_LARGE = "a whole number beyond 64 bits, which TOML does not have; write a smaller one"


def _beyond_64_bits(value: Any, path: KeyPath = ()) -> KeyPath | None:
    """Where the first whole number is that fits into no 64 bits, the limit of TOML; or None."""
    if isinstance(value, int):
        return None if -(1 << 63) <= value < 1 << 63 else path
    items: Iterable[tuple[str | int, Any]] = ()
    if isinstance(value, dict):
        items = value.items()
    elif isinstance(value, list):
        items = enumerate(value)
    for key, item in items:
        if isinstance(item, int | dict | list):  # most are other numbers, as of ten thousand poses
            where = _beyond_64_bits(item, (*path, key))
            if where is not None:
                return where
    return None


def _syntax_message(file: Path, text: str, error: tomllib.TOMLDecodeError) -> str:
    """Splits tomllib's `what (at line 3, column 7)` or `what (at end of document)`."""
    what, _, position = str(error).partition(" (at ")
    line = text.count("\n") + (not text.endswith("\n"))
    if position.startswith("line "):
        line = int(position.removeprefix("line ").split(",")[0])
    said = f"{what[:1].lower()}{what[1:]}"
    return f"{file}:{line}: not valid TOML: {said}; {hint(text, line, what)}"


def _apply(raw: dict[str, Any], setting: Setting) -> KeyPath:
    """Puts the value in its place, making tables and array items on the way; returns its path."""
    container: Any = raw
    path: KeyPath = ()
    for key, following in zip(setting.keys, (*setting.keys[1:], None), strict=True):
        step: str | int = key
        if isinstance(container, list):
            step = _index(container, path, key, setting)
        elif not isinstance(container, dict):
            above = ".".join(map(str, path))
            raise InputError(f"{setting.written}: {above} is a value and has no keys below it")
        path = (*path, step)
        if following is None:
            _put(container, step, setting.value)
        else:
            if isinstance(container, list) and step == len(container):
                container.append({})
            elif isinstance(container, dict) and step not in container:
                container[step] = [] if following.isdigit() else {}
            container = container[step]
    return path


def _index(items: list[Any], above: KeyPath, key: str, setting: Setting) -> int:
    """The item of a list below `above` that a setting means by `key`."""
    if not key.isdigit() or int(key) > len(items):
        left = setting.keys[len(above) + key.isdigit() :]
        typed = ".".join(map(str, (*above, 0, *left)))
        value = setting.written.partition("=")[2]
        name, number = ".".join(map(str, above)), len(items)
        last = f", {name}.{number - 1} is its last" if number > 1 else ""
        raise InputError(
            f"{setting.written}: {name} is a list of {number}; for its first type --set "
            f"{typed}={value} ({name}.{number} adds one{last})"
        )
    return int(key)


def _put(container: Any, step: str | int, value: Any) -> None:
    if isinstance(container, list) and step == len(container):
        container.append(value)
    else:
        container[step] = value
