"""Types of values with their ranges, and the rules that hold for every table of an experiment."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from kilotwin.files.headers import MOST_COLUMNS
from kilotwin.units import TICK_S

Text = Annotated[str, Field(min_length=1, max_length=200)]
Length = Annotated[float, Field(gt=0, le=1000)]
Coordinate = Annotated[float, Field(ge=-1000, le=1000)]
Point = Annotated[list[Coordinate], Field(min_length=2, max_length=2)]
Pose = Annotated[list[Coordinate], Field(min_length=3, max_length=3)]
Heading = Annotated[float, Field(ge=-10, le=10)]
Shape = Literal["circle", "rectangle", "polygon"]
Outline = Annotated[list[Point], Field(min_length=3, max_length=2000)]
Share = Annotated[float, Field(ge=0, le=1)]
# Columns or rows of modules: five bits of a CAN identifier, less the one that means all.
Modules = Annotated[int, Field(ge=1, le=MOST_COLUMNS)]
Module = Annotated[
    list[Annotated[int, Field(ge=0, le=MOST_COLUMNS - 1)]], Field(min_length=2, max_length=2)
]
Rectangle = Annotated[list[Coordinate], Field(min_length=4, max_length=4)]
# A standard deviation, as a share of the value that it spreads.
Spread = Annotated[float, Field(ge=0, le=0.3)]
MOST_ROBOTS = 1_000_000
Count = Annotated[int, Field(ge=1, le=MOST_ROBOTS)]
LAST_UID = 65535
Uid = Annotated[int, Field(ge=0, le=LAST_UID)]
Byte = Annotated[int, Field(ge=0, le=255)]
# Those of a program; system messages have higher types.
MessageType = Annotated[int, Field(ge=0, le=0x7F)]
MessageData = Annotated[list[Byte], Field(max_length=9)]
# A reading of an analog-to-digital converter.
Reading10 = Annotated[float, Field(ge=0, le=1023)]
# CONFIG carries reals as 32 bits of Q16 and most periods as 16 bits of ticks (wire.h).
Real = Annotated[float, Field(ge=0, le=65535)]
Period = Annotated[float, Field(ge=TICK_S, le=2147)]
Pause = Annotated[float, Field(ge=0, le=2147)]
Window = Annotated[float, Field(ge=TICK_S, le=1048)]


def one_or_more(value: Any) -> Any:
    """A list of one where a single text was written."""
    return [value] if isinstance(value, str) else value


class Section(BaseModel):
    """A table of the file: no unknown keys, no text for numbers, no NaN."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        frozen=True,
        defer_build=True,  # one within another is checked by that one's rules
    )


def lineage(section: type[BaseModel]) -> list[type[BaseModel]]:
    """The section, and then those that it takes keys from."""
    return [
        kind
        for kind in section.__mro__
        if issubclass(kind, BaseModel) and kind.__annotations__.keys() & section.model_fields.keys()
    ]


def keys_of(section: type[BaseModel]) -> list[str]:
    """All keys, its own first: tables of one program come behind those of all experiments."""
    names = [name for kind in lineage(section) for name in kind.__annotations__]
    return [name for name in dict.fromkeys(names) if name in section.model_fields]
