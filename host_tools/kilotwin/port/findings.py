"""Findings of `kilotwin port` on a program."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from kilotwin.port.disassembly import Place


class Weight(StrEnum):
    """How much a finding matters."""

    FAILS = "fails"
    """It does not work on the robot, or was seen to do something else there."""
    WARNS = "warns"
    """It works now and then, or not as it does here."""


@dataclass(frozen=True)
class Finding:
    """`check` is the check's short name; `place` None where no line is to blame."""

    check: str
    weight: Weight
    what: str
    do: str
    place: Place | None = None

    def text(self) -> str:
        """file:line: fails: what; do."""
        where = f"{self.place.file}:{self.place.line}: " if self.place else ""
        return f"{where}{self.weight}: {self.what} [{self.check}]\n    {self.do}"

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        return {
            "check": self.check,
            "weight": self.weight.value,
            "file": self.place.file if self.place else None,
            "line": self.place.line if self.place else None,
            "what": self.what,
            "do": self.do,
        }
