"""A program's parameters as its `wire` declares them, in a file of its own:

    type = 5                        # of the message
    [parameter.step_s]              # a key of [parameters]
    kind = "seconds"                # what people write; on air ticks of 32.768 ms
    bytes = 2
    byte = 0                        # where in the message's data

Parameters with `byte` share one message of nine bytes. With `key` each has a message of its own,
laid out as CONFIG of firmware/aggregation/wire.h is: first and last uid, the key, four bytes.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, ValidationError, create_model

from kilotwin.errors import InputError
from kilotwin.experiment.files import find_file, shown
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.parameter import Kind, Parameter
from kilotwin.experiment.schema.section import Byte, MessageType, Section, Text
from kilotwin.experiment.spec.overhead import DATA_BYTES, message
from kilotwin.experiment.text import ExperimentText
from kilotwin.experiment.toml_lines import KeyPath
from kilotwin.experiment.validation_errors import input_error
from kilotwin.units import TICK_S

_KEY_AT, _VALUE_BYTES = 4, 4  # in a message with a key
_FOR_ALL = b"\0\0\xff\xff"


class DeclaredParameter(Section):
    """One parameter: what people may write, and where it is on air."""

    kind: Kind
    """What is written; on air a whole number."""
    unit: Text | None = None
    """Its unit, for the table."""
    meaning: Text | None = None
    """What it is, for the table."""
    least: float | None = None
    """The least that may be written; 0 if left out."""
    most: float | None = None
    """The most; what fits into its bytes, if left out."""
    choices: Annotated[list[Text], Field(min_length=1, max_length=256)] | None = None
    """choice: the words, numbered from 0."""
    default: bool | int | float | Text | None = None
    """Its value if left out; without one it must be given."""
    scale: Annotated[int, Field(ge=1, le=1 << 24)] = 1
    """real, seconds: by which it is multiplied on air."""
    bytes: Literal[1, 2, 4] = 2
    """How many bytes it has, low ones first; signed if `least` is negative."""
    byte: Annotated[int, Field(ge=0, le=DATA_BYTES - 1)] | None = None
    """Its first byte in the message's data."""
    key: Byte | None = None
    """In place of `byte`: its key, in a message of its own."""

    @property
    def on_air(self) -> Parameter:
        """How it becomes a number."""
        return Parameter(self.kind, self.scale, tuple(self.choices or ()))

    @property
    def size(self) -> int:
        """Bytes on air."""
        return _VALUE_BYTES if self.key is not None else self.bytes

    @property
    def is_signed(self) -> bool:
        """Whether its number may be negative."""
        return self.least is not None and self.least < 0

    @property
    def range(self) -> tuple[float, float]:
        """What may be written, of whole, real and seconds."""
        bits = 8 * self.size - self.is_signed
        most = ((1 << bits) - 1) / self.scale
        if self.kind == "seconds":
            most *= TICK_S
        if self.kind == "whole":
            most = (1 << bits) - 1
        return self.least or 0, most if self.most is None else self.most

    def number_fits(self, value: float) -> bool:
        """Whether the number of a value fits into its bytes."""
        bits = 8 * self.size - self.is_signed
        number = self.on_air.number(value)
        return -(1 << bits) * self.is_signed <= number < 1 << bits


class WireSchema(Section):
    """A whole file."""

    type: MessageType
    """The message's type."""
    parameter: Annotated[dict[Text, DeclaredParameter], Field(min_length=1, max_length=100)]
    """By name: the keys of [parameters]."""


@dataclass(frozen=True)
class Wire:
    """A declaration and the values of one experiment."""

    file: Path
    keys: WireSchema
    values: dict[str, Any]

    def messages(self) -> list[bytes]:
        """Messages to all robots before the run: nine bytes and the type each."""
        packed, keyed = bytearray(DATA_BYTES), []
        for name, parameter in self.keys.parameter.items():
            number = parameter.on_air.number(self.values[name])
            raw = number.to_bytes(parameter.size, "little", signed=parameter.is_signed)
            if parameter.key is not None:
                keyed.append(message(_FOR_ALL + bytes([parameter.key]) + raw, self.keys.type))
            elif parameter.byte is not None:
                packed[parameter.byte : parameter.byte + len(raw)] = raw
        has_packed = any(one.byte is not None for one in self.keys.parameter.values())
        return [*([message(packed, self.keys.type)] if has_packed else []), *keyed]

    def sha256(self) -> str:
        """Digest of the declaration."""
        return hashlib.sha256(self.file.read_bytes()).hexdigest()


def wire_of(keys: ExperimentSchema, origin: ExperimentText) -> Wire:
    """The declaration that swarm.wire names, with [parameters] checked by it, of an experiment that
    has one of these.

    InputError names the place, in either file."""
    if keys.swarm.wire is None:
        what = "which program's? Add swarm.wire, the file that declares them"
        raise InputError(f"{origin.where(('parameters',))}: {what}")
    file = find_file(keys.swarm.wire, ("swarm", "wire"), origin)
    declared = read_wire(shown(file))
    model = create_model("Parameters", __base__=Section, parameters=(_table(declared), ...))
    try:
        checked = model.model_validate({"parameters": keys.parameters or {}})
    except ValidationError as error:
        raise input_error(origin, error, schema=model) from None
    return Wire(file, declared, checked.model_dump()["parameters"])


def read_wire(file: Path) -> WireSchema:
    """Reads and checks a declaration; InputError names file and line."""
    origin = ExperimentText.read(file, [])
    origin.raw.pop("name", None)
    try:
        declared = WireSchema.model_validate(origin.raw)
    except ValidationError as error:
        raise input_error(origin, error, schema=WireSchema) from None
    for path, what in _problems(declared):
        raise InputError(f"{origin.where(('parameter', *path))}: {what}")
    try:
        _table(declared)()
    except ValidationError as error:
        for problem in error.errors():
            if problem["type"] != "missing":
                name = str(problem["loc"][0])
                path = ("parameter", name, "default")
                what = f"default is {problem['input']!r}, which {name} may not be"
                raise InputError(f"{origin.where(path)}: {what}") from None
    return declared


def _table(declared: WireSchema) -> type[Section]:
    """The table [parameters] as a schema."""
    fields: dict[str, Any] = {
        name: (_annotation(parameter), ... if parameter.default is None else parameter.default)
        for name, parameter in declared.parameter.items()
    }
    return create_model("Table", __base__=_Checked, **fields)


class _Checked(Section):
    """Checks its defaults too."""

    model_config = ConfigDict(validate_default=True)


def _annotation(parameter: DeclaredParameter) -> Any:
    if parameter.kind == "yes_no":
        return bool
    if parameter.kind == "choice":
        words: Any = tuple(parameter.choices or ())
        return Literal[words]
    least, most = parameter.range
    whole = parameter.kind == "whole"
    return Annotated[int if whole else float, Field(ge=least, le=most)]


def _problems(declared: WireSchema) -> Iterator[tuple[KeyPath, str]]:
    taken: dict[int, str] = {}
    keys: dict[int, str] = {}
    for name, parameter in declared.parameter.items():
        yield from _problems_of(name, parameter)
        if parameter.key is not None:
            other = keys.setdefault(parameter.key, name)
            if other != name:
                yield (name, "key"), f"key {parameter.key} is that of {other}; take another"
        elif parameter.byte is not None:
            for place in range(parameter.byte, parameter.byte + parameter.bytes):
                other = taken.setdefault(place, name)
                if other != name:
                    yield (name, "byte"), f"byte {place} is one of {other}; take another"


def _problems_of(name: str, parameter: DeclaredParameter) -> Iterator[tuple[KeyPath, str]]:
    if not name.isidentifier():
        yield (name,), f"'{name}' is no name; write letters, digits and _"
    if (parameter.byte is None) == (parameter.key is None):
        yield (name,), "where is it on air? Give it either 'byte' or 'key'"
    elif parameter.byte is not None and parameter.byte + parameter.bytes > DATA_BYTES:
        what = f"{parameter.bytes} bytes from byte {parameter.byte} on; a message has {DATA_BYTES}"
        yield (name, "byte"), what
    if (parameter.kind == "choice") != (parameter.choices is not None):
        yield (name,), "'choices' goes with kind = \"choice\", and only with that"
    if parameter.kind in ("yes_no", "choice"):
        return
    if parameter.kind == "whole" and parameter.scale != 1:
        yield (name, "scale"), "a whole number is sent as it is; leave 'scale' out"
    least, most = parameter.range
    for key, bound in (("least", least), ("most", most)):
        if not parameter.number_fits(bound):
            what = f"{key} is {bound:g}, whose number does not fit into {parameter.size} bytes"
            yield (name, key), f"{what}; take more bytes, or a smaller scale"
    if least > most:
        yield (name, "most"), f"most is {most:g}, below least ({least:g})"


def wire_table(declared: WireSchema) -> str:
    """The parameters as a table in Markdown, for a lab's own page."""
    rows = ["| key | allowed | default | unit | meaning |", "|---|---|---|---|---|"]
    for name, parameter in declared.parameter.items():
        default = "must be given" if parameter.default is None else f"`{_shown(parameter.default)}`"
        cells = (f"`parameters.{name}`", _allowed(parameter), default)
        rows.append(f"| {' | '.join((*cells, parameter.unit or '', parameter.meaning or ''))} |")
    return "\n".join(rows) + "\n"


def _allowed(parameter: DeclaredParameter) -> str:
    if parameter.kind == "yes_no":
        return "true, false"
    if parameter.kind == "choice":
        return ", ".join(f'`"{word}"`' for word in parameter.choices or ())
    least, most = parameter.range
    word = "whole number" if parameter.kind == "whole" else "number"
    return f"{word} from {least:g} up to {most:.6g}"


def _shown(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else repr(value).replace("'", '"')
