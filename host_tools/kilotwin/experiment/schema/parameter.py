"""A parameter of a robot's program: a named value, and the whole number that a message carries."""

from dataclasses import dataclass
from typing import Any, Literal

from kilotwin.units import TICK_S

Kind = Literal["whole", "real", "seconds", "yes_no", "choice"]


@dataclass(frozen=True)
class Parameter:
    """`kind` is what people write; on air it is a whole number.

    `whole` as it is, `real` times `scale`, `seconds` in ticks of 32.768 ms times `scale`, `yes_no`
    as 1 or 0, `choice` as its place among `choices`, from 0.
    """

    kind: Kind
    scale: int = 1
    choices: tuple[str, ...] = ()

    def number(self, value: Any) -> int:
        """The number that is sent for `value`, which must be of the kind; the nearest one."""
        if self.kind == "choice":
            return self.choices.index(value)
        if self.kind == "real":
            return round(float(value) * self.scale)
        if self.kind == "seconds":
            return round(float(value) / TICK_S * self.scale)
        return int(value)
