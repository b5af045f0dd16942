"""The tables of all keys in docs/experiments.md and of built-in metrics in docs/metrics.md.

`python -m kilotwin.experiment.docs FILE` renews them from the schema; a test compares. Of a file
that declares a program's parameters it prints their table.
"""

import ast
import inspect
import itertools
import json
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from kilotwin.experiment.schema.controller import CONTROLLER_DEFAULTS, READING_DEFAULTS
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.metric import BUILTINS, CHOICE, Builtin
from kilotwin.experiment.schema.profile_defaults import KILOBOT_MEDIUM, PROFILES, motion_defaults
from kilotwin.experiment.schema.section import keys_of, lineage
from kilotwin.experiment.validation_errors import bare, is_section, limits
from kilotwin.experiment.wire_file import read_wire, wire_table

_HEAD = "| key | allowed | default | meaning |\n|---|---|---|---|\n"
_BUILTINS_HEAD = "| builtin | keys | unit | what it is |\n|---|---|---|---|\n"
_WORDS = {
    float: "number",
    int: "whole number",
    str: "text",
    bool: "true, false",
    list: "list",
    dict: "table",
}
# Ranges that the types do not have.
_ALLOWED = {
    "parameters": "table",
    "swarm.program": "text or list",
    "robots.program": "text or list",
    "grid.program": "text or list",
    "faults.module.module": "list",
}
_DEFAULTS = {
    "obstacle.blocks_light": "`true` (foot-bot), `false` (kilobot)",
    "arena.blocks_light": "`true` (foot-bot), `false` (kilobot)",
    "name": "the file's name",
    "controller.neighbour_timeout_s": "as the window",
    "swarm.floor": "`true` (foot-bot), `false` (kilobot, and on a grid)",
}


def table() -> str:
    """Every key, in the order of the schema."""
    return _HEAD + "".join(_rows(ExperimentSchema, ""))


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
    """The document with its table of keys, or of built-in metrics, made anew."""
    for head, made in ((_HEAD, table), (_BUILTINS_HEAD, builtins_table)):
        before, found, rest = document.partition(head)
        if found:
            rows = rest.split("\n")
            after = next(i for i, row in enumerate(rows) if not row.startswith("|"))
            return before + made() + "\n".join(rows[after:])
    raise ValueError("the document has no table of keys")


def _rows(section: type[BaseModel], prefix: str) -> Iterator[str]:
    meanings = {name: text for kind in lineage(section) for name, text in _meanings(kind).items()}
    for name in keys_of(section):
        field = section.model_fields[name]
        kind = bare(field.annotation)
        inner = bare(get_args(kind)[-1]) if get_origin(kind) in (list, dict) else kind
        if is_section(inner):
            many = get_origin(kind) is list
            path = f"{prefix}{name}" + ".NAME" * (get_origin(kind) is dict)
            title = f"`[[{path}]]`" if many else f"`[{path}]`"
            yield f"| **{title}** | | | {_cell(_first_line(inner))} |\n"
            yield from _rows(inner, f"{path}.")
        else:
            key = f"{prefix}{name}"
            allowed = _ALLOWED.get(key) or _allowed(field)
            default = _DEFAULTS.get(key) or _default(prefix, name, field)
            meaning = _cell(field.description or meanings[name])
            yield f"| `{key}` | {allowed} | {default} | {meaning} |\n"


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


def _first_line(section: type[BaseModel]) -> str:
    return (section.__doc__ or "").partition("\n\n")[0].replace("\n    ", " ")


def _cell(text: str) -> str:
    return text.replace("\n", " ").replace("|", "\\|")


def _allowed(field: FieldInfo) -> str:
    kind = bare(field.annotation)
    choices = get_args(kind) if get_origin(kind) is not None else ()
    if choices and get_origin(kind) not in (list, dict):
        return ", ".join(f"`{json.dumps(choice)}`" for choice in choices)
    word = _WORDS[get_origin(kind) or kind]
    return " ".join([word, limits(field)]).strip()


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
            "medium.": {"kind": profile.medium, "range_m": profile.range_m, **KILOBOT_MEDIUM},
        }
        if name in own.get(prefix, {}):
            by_robot[profile.name] = own[prefix][name]
    if prefix == "medium." and name in KILOBOT_MEDIUM:
        return f"{_value(KILOBOT_MEDIUM[name])}; `ideal` has no such key"
    if by_robot and len({_value(value) for value in by_robot.values()}) == 1:
        return _value(next(iter(by_robot.values())))
    if by_robot:
        return ", ".join(f"{_value(value)} ({robot})" for robot, value in by_robot.items())
    if field.is_required() or field.default is None:
        return "must be given" if field.is_required() else ""
    return _value(field.default)


def _value(value: Any) -> str:
    return f"`{json.dumps(value)}`"


if __name__ == "__main__":
    file = Path(sys.argv[1])
    if file.suffix == ".toml":
        sys.stdout.write(wire_table(read_wire(file)))
        sys.exit()
    file.write_text(renewed(file.read_text()))
