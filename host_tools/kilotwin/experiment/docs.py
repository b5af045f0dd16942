"""The tables of keys in docs/experiments.md, one for each table of an experiment file, and the
table of built-in metrics in docs/metrics.md.

`python -m kilotwin.experiment.docs FILE` renews them from the schema; a test compares. Of a file
that declares a program's parameters it prints their table.
"""

import ast
import inspect
import itertools
import json
import re
import sys
import textwrap
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from kilotwin.experiment.schema.controller import CONTROLLER_DEFAULTS, READING_DEFAULTS
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.medium import MEDIUM_DEFAULTS
from kilotwin.experiment.schema.metric import BUILTINS, CHOICE, Builtin
from kilotwin.experiment.schema.profile_defaults import PROFILES, motion_defaults
from kilotwin.experiment.schema.section import keys_of, lineage
from kilotwin.experiment.validation_errors import bare, is_section, limits
from kilotwin.experiment.wire_file import read_wire, wire_table

_HEAD = "| key | allowed | default | meaning |\n|---|---|---|---|\n"
_BUILTINS_HEAD = "| builtin | keys | unit | what it is |\n|---|---|---|---|\n"
_WORDS = {
    float: "number",
    int: "integer",
    str: "text",
    bool: "true, false",
    list: "list",
    dict: "table",
}
# Values of tables whose keys are names of the user's.
_VALUES = {"parameters": "as declared", "states": "list or colour"}
# Ranges that the types do not have.
_ALLOWED = {
    "swarm.program": "text or list",
    "robots.program": "text or list",
    "robots.poses": "list or text",
    "grid.program": "text or list",
    "faults.module.module": "list",
}
_DEFAULTS = {
    "obstacle.blocks_light": "`true` (foot-bot), `false` (kilobot)",
    "arena.blocks_light": "`true` (foot-bot), `false` (kilobot)",
    "name": "the file's name",
    "controller.neighbour_timeout_s": "as the window",
    "record.sample_s": "`10` (foot-bot), `1` (kilobot; `0.25` in runs of up to 300 s)",
    "swarm.floor": "`true` (foot-bot), `false` (kilobot, and on a grid)",
}
TOP = "Keys of no table"
"""Heading of the section with the keys above the first table of a file."""
_SHAPES = "Shapes"
"""Heading of the section that says what the sizes of a shape mean, for all tables that have one."""
_SIZES = ("diameter_m", "width_m", "height_m", "points_m")
_SECTION = re.compile(r"^(?=##+ )", re.MULTILINE)


def tables() -> dict[str, str]:
    """The keys of each table of a file, by its heading in docs/experiments.md."""
    found: dict[str, str] = {}
    _collect(ExperimentSchema, "", TOP, found)
    return found


def builtins_table() -> str:
    """Every built-in metric, as docs/metrics.md has them."""
    return _BUILTINS_HEAD + "".join(
        f"| `{name}` | {_keys(builtin)} | {builtin.unit} | {builtin.meaning} |\n"
        for name, builtin in BUILTINS.items()
    )


def _keys(builtin: Builtin) -> str:
    may_have = ["choice" if builtin.may_have == CHOICE else f"`{key}`" for key in builtin.may_have]
    optional = [f"({key})" for key in dict.fromkeys(may_have)]
    return ", ".join([*(f"`{key}`" for key in builtin.needs), *optional])


def renewed(document: str) -> str:
    """The document with its tables of keys, or of built-in metrics, made anew."""
    if _BUILTINS_HEAD in document:
        return _filled(document, builtins_table())
    parts = _SECTION.split(document)
    made = tables()
    filled = [
        _filled(part, made.pop(heading(part))) if heading(part) in made else part for part in parts
    ]
    if made:
        raise ValueError(f"the document has no section for {', '.join(made)}")
    return "".join(filled)


def heading(part: str) -> str:
    """The heading that a part of a document begins with: `[arena]`."""
    return part.partition("\n")[0].strip("#` ")


def _filled(part: str, table: str) -> str:
    """The part with its table, the one that begins as `table` does, made anew."""
    head = "".join(table.splitlines(keepends=True)[:2])
    before, found, rest = part.partition(head)
    if not found:
        raise ValueError(f"the section {heading(part)} has no table of keys")
    while rest.startswith("|"):
        rest = rest.partition("\n")[2]
    return before + table + rest


def _collect(section: type[BaseModel], prefix: str, title: str, found: dict[str, str]) -> None:
    """The rows of a table, then those of the tables within it."""
    meanings = {name: text for kind in lineage(section) for name, text in _meanings(kind).items()}
    shaped = set(_SIZES) <= section.model_fields.keys()
    rows: list[str] = []
    inner: list[tuple[type[BaseModel], str, str]] = []
    found[title] = ""  # its place is before those of the tables within
    for name in keys_of(section):
        field = section.model_fields[name]
        kind = bare(field.annotation)
        value = bare(get_args(kind)[-1]) if get_origin(kind) in (list, dict) else kind
        path = f"{prefix}{name}"
        if is_section(value):
            path += ".NAME" * (get_origin(kind) is dict)
            inner.append((value, path, f"[[{path}]]" if get_origin(kind) is list else f"[{path}]"))
        elif get_origin(kind) is dict and not prefix:
            meaning = _cell(field.description or meanings[name])
            found[f"[{name}]"] = f"{_HEAD}| `NAME` | {_VALUES[name]} |  | {meaning} |\n"
        elif shaped and name in _SIZES:
            if name == _SIZES[0]:
                sizes = ", ".join(f"`{size}`" for size in _SIZES)
                rows.append(f"| {sizes} | by `shape` |  | [{_SHAPES}](#{_SHAPES.lower()}) |\n")
        else:
            rows.append(_row(prefix, name, field, field.description or meanings[name]))
    found[title] = _HEAD + "".join(rows)
    for value, path, below in inner:
        _collect(value, f"{path}.", below, found)


def _row(prefix: str, name: str, field: FieldInfo, meaning: str) -> str:
    allowed = _ALLOWED.get(f"{prefix}{name}") or _allowed(field)
    default = _DEFAULTS.get(f"{prefix}{name}") or _default(prefix, name, field)
    return f"| `{name}` | {allowed} | {default} | {_cell(meaning)} |\n"


def _meanings(section: type[BaseModel]) -> dict[str, str]:
    """Texts below a section's fields. Pydantic can read them, but at each start of `kilotwin`."""
    (parsed,) = ast.parse(textwrap.dedent(inspect.getsource(section))).body
    assert isinstance(parsed, ast.ClassDef)
    return {
        field.target.id: inspect.cleandoc(text.value.value)
        for field, text in itertools.pairwise(parsed.body)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
        if isinstance(text.value.value, str)
    }


def _cell(text: str) -> str:
    return text.replace("\n", " ").replace("|", "\\|").strip()


def _allowed(field: FieldInfo) -> str:
    kind = bare(field.annotation)
    choices = get_args(kind) if get_origin(kind) is not None else ()
    if choices and get_origin(kind) not in (list, dict):
        return ", ".join(f"`{json.dumps(choice)}`" for choice in choices)
    word = _WORDS[get_origin(kind) or kind]
    limit = limits(field).replace("from ", "").replace(" up to ", " to ")
    return f"{word} {limit}".strip()


def _default(prefix: str, name: str, field: FieldInfo) -> str:
    """The default of the key; by robot where that decides."""
    by_robot: dict[str, Any] = {}
    for profile in PROFILES.values():
        own: dict[str, dict[str, Any]] = {
            "swarm.": {"floor": profile.virtual_floor, "runtime": profile.runtime},
            "controller.": dict(CONTROLLER_DEFAULTS[profile.name]),
            "motion.": motion_defaults(profile),
            "reading.": dict(READING_DEFAULTS[profile.name]),
            "engine.": {"step_ticks": profile.step_ticks},
            "medium.": {"kind": profile.medium, "range_m": profile.range_m, **MEDIUM_DEFAULTS},
        }
        if name in own.get(prefix, {}):
            by_robot[profile.name] = own[prefix][name]
    if prefix == "medium." and name in MEDIUM_DEFAULTS:
        return _value(MEDIUM_DEFAULTS[name])
    if by_robot and len({_value(value) for value in by_robot.values()}) == 1:
        return _value(next(iter(by_robot.values())))
    if by_robot:
        return ", ".join(f"{_value(value)} ({robot})" for robot, value in by_robot.items())
    if field.is_required() or field.default is None:
        return "required" if field.is_required() else ""
    return _value(field.default)


def _value(value: Any) -> str:
    return f"`{json.dumps(value)}`"


if __name__ == "__main__":
    file = Path(sys.argv[1])
    if file.suffix == ".toml":
        sys.stdout.write(wire_table(read_wire(file)))
        sys.exit()
    file.write_text(renewed(file.read_text()))
