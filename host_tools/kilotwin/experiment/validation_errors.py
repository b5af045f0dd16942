"""Turns what pydantic finds wrong with an experiment into one line: where, what, what to do."""

import difflib
import json
import types
from typing import Annotated, Any, TypeGuard, Union, get_args, get_origin

from annotated_types import MaxLen, MinLen
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from kilotwin.errors import InputError
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.section import keys_of
from kilotwin.experiment.text import ExperimentText
from kilotwin.experiment.toml_lines import KeyPath

_KINDS = {
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "text in quotes",
    "bool_type": "true or false",
    "list_type": "a list in [ ], or [[ ]] tables",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "finite_number": "a finite number",
}
_EXAMPLES = {
    "duration_s": "duration_s = 30000",
    "centre_m": "centre_m = [0.0, 0.0]",
    "size": "size = 100",
    "profile": 'profile = "foot-bot"',
    "program": 'program = "firmware/aggregation"',
    "arena": "[arena] with diameter_m = 19.2",
    "swarm": "[swarm] with profile, program and size",
}
_GONE = {
    ("engine", "contact_solver"): "Box2D solves every contact now; leave the key out",
}


def input_error(
    text: ExperimentText,
    error: ValidationError,
    below: KeyPath = (),
    schema: type[BaseModel] = ExperimentSchema,
) -> InputError:
    """The problem to mend first: unknown keys, then wrong values, then missing ones.

    `below` is the path of what was validated, if that was not the whole file; `schema` the file's.
    """
    order = {"extra_forbidden": 0, "missing": 2}
    worst = min(error.errors(), key=lambda problem: order.get(problem["type"], 1))
    path: KeyPath = (*below, *worst["loc"])
    # A key that is not there is missed where its table stands.
    place = path[:-1] if worst["type"] == "missing" and len(path) > 1 else path
    # A sweep's keys are dotted ones.
    place = tuple(
        key for step in place for key in (step.split(".") if isinstance(step, str) else [step])
    )
    return InputError(f"{text.where(place)}: {_describe(dict(worst), path, schema)}")


def dotted(path: KeyPath) -> str:
    """`site.0.diameter_m`, as `--set` takes it."""
    return ".".join(map(str, path))


def _describe(problem: dict[str, Any], path: KeyPath, schema: type[BaseModel]) -> str:
    kind, key = problem["type"], str(path[-1]) if path else ""
    if kind == "extra_forbidden":
        return _unknown_key(path, schema)
    if kind == "missing":
        example = _EXAMPLES.get(key, f"{key} = ...")
        return f"{_table(path[:-1])} lacks '{key}'; add {example}"
    value = _shown(problem["input"])
    annotation, metadata = _field_at(path, schema)
    allowed = _range(metadata)
    if kind in _KINDS:
        return f"{dotted(path)} is {value}; it must be {_KINDS[kind]}{allowed and f', {allowed}'}"
    if kind == "literal_error":
        choices = [str(choice) for choice in get_args(bare(annotation))]
        return f"{dotted(path)} is {value}; {_nearest(str(problem['input']), choices)}"
    if kind.startswith(("greater_than", "less_than")):
        return f"{dotted(path)} is {value}; it must be {allowed}"
    if kind in ("too_short", "too_long"):
        context = problem["ctx"]
        wanted = context.get("min_length", context.get("max_length"))
        exact = {MinLen(wanted), MaxLen(wanted)} <= set(metadata)
        bound = "" if exact else "at least " if kind == "too_short" else "at most "
        actual = context["actual_length"]
        items = "1 item" if actual == 1 else f"{actual} items"
        return f"{dotted(path)} has {items}; it must have {bound}{wanted}"
    if kind == "value_error":
        return f"{dotted(path)} is {value}; it {problem['ctx']['error']}"
    return f"{dotted(path)} is {value}; {problem['msg'].lower()}"


def _unknown_key(path: KeyPath, schema: type[BaseModel]) -> str:
    if path in _GONE:
        return f"{dotted(path)} is gone: {_GONE[path]}"
    annotation, _ = _field_at(path[:-1], schema)
    model = bare(annotation)
    known = keys_of(model) if is_section(model) else []
    return f"unknown key '{path[-1]}' in {_table(path[:-1])}; {_nearest(str(path[-1]), known)}"


def _nearest(word: str, choices: list[str]) -> str:
    near = difflib.get_close_matches(word, choices, n=1)
    hint = f"did you mean '{near[0]}'? Allowed" if near else "allowed"
    return f"{hint}: {', '.join(choices)}"


def _table(path: KeyPath) -> str:
    if not path:
        return "the experiment"
    names = tuple(step for step in path if isinstance(step, str))
    return f"[[{dotted(names)}]]" if isinstance(path[-1], int) else f"[{dotted(path)}]"


def _shown(value: Any) -> str:
    try:
        text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError):
        text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _field_at(path: KeyPath, schema: type[BaseModel]) -> tuple[Any, list[Any]]:
    """The annotation and the metadata of the schema's field at `path`."""
    annotation: Any = schema
    metadata: list[Any] = []
    for step in path:
        inner = bare(annotation)
        if is_section(inner):
            field = inner.model_fields.get(str(step))
            if field is None:
                return None, []
            annotation, metadata = field.annotation, field.metadata
        else:
            arguments = get_args(inner)
            annotation, metadata = (arguments[-1] if arguments else None), []
        annotation, more = _unwrap(annotation)
        metadata = [*metadata, *more]
    return annotation, metadata


def is_whole_number(keys: KeyPath) -> bool:
    """Whether an experiment's key, as ("swarm", "size"), takes whole numbers only."""
    return bare(_field_at(keys, ExperimentSchema)[0]) is int


def is_section(annotation: Any) -> TypeGuard[type[BaseModel]]:
    """Whether it is a table of the schema."""
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _unwrap(annotation: Any) -> tuple[Any, list[Any]]:
    """The type without `| None` and Annotated, and the constraints of the latter."""
    if get_origin(annotation) in (Union, types.UnionType):
        (annotation,) = (part for part in get_args(annotation) if part is not type(None))
    if get_origin(annotation) is Annotated:
        inner, *extras = get_args(annotation)
        constraints: list[Any] = []
        for extra in extras:
            constraints += extra.metadata if isinstance(extra, FieldInfo) else [extra]
        return inner, constraints
    return annotation, []


def bare(annotation: Any) -> Any:
    """A field's annotation without `| None` and constraints."""
    return _unwrap(annotation)[0]


def limits(field: FieldInfo) -> str:
    """`from 0 up to 1`, of a field of the schema; nothing where anything goes."""
    return _range([*field.metadata, *_unwrap(field.annotation)[1]])


def _range(metadata: list[Any]) -> str:
    """`from 0 up to 1`; nothing where anything goes."""
    words = {"ge": "from", "gt": "above", "le": "up to", "lt": "below"}
    parts: list[str] = []
    for constraint in metadata:
        for name, word in words.items():
            limit = getattr(constraint, name, None)
            if limit is not None:
                shown = limit if isinstance(limit, int) else f"{limit:.15g}"
                parts.append(f"{word} {shown}")
    return " ".join(parts)
