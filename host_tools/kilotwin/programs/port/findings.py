"""Findings of `kilotwin port` on a program."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from kilotwin.programs.port.disassembly import Place


class Weight(StrEnum):
    """How much a finding matters."""

    FAILS = "fails"
    """It does not work on the robot, or was seen to do something else there."""
    WARNS = "warns"
    """It works now and then, or not as it does here."""


# Consequences of a finding, the worst first; of one kind those that fail come before.
_CONSEQUENCES = (
    # The robot does not take the program, or does not go on.
    ("flash", "stack", "stops", "stack-meets-data", "fails-here"),
    # It does something else.
    ("differs-in-passes", "differs", "no-kick", "no-crc", "two-programs"),
    # Variables get values that nobody gave them.
    ("array-bounds", "int-overflow", "float-to-int", "int-width", "no-return"),
    # An action meant to happen once happens often, or not at all.
    ("tick-modulo", "tick-equal", "few-bits"),
    # Now and then a value is wrong, or a message is lost.
    ("before-setup", "message-race", "torn-access"),
    # Ticks and messages are lost.
    ("long-callback", "ticks-lost", "slow-interrupt", "float-in-interrupt"),
    # It does the same, later.
    ("differs-in-time",),
)
CHECKS = tuple(check for checks in _CONSEQUENCES for check in checks)
"""Every finding that can be printed, the worst first; docs/porting.md has a section for each."""
_SHOWN = 8


@dataclass(frozen=True)
class Finding:
    """`check` is the check's short name; `place` None where no line is to blame."""

    check: str
    weight: Weight
    what: str
    do: str
    place: Place | None = None
    more: tuple[Place, ...] = ()
    """Other places of the same."""

    @property
    def rank(self) -> tuple[bool, int]:
        """Lower: more comes of it."""
        kinds = [number for number, kind in enumerate(_CONSEQUENCES) if self.check in kind]
        return self.weight is not Weight.FAILS, kinds[0]

    def text(self) -> str:
        """file:line: fails: what; where else; do."""
        where = f"{self.place.file}:{self.place.line}: " if self.place else ""
        return f"{where}{self.weight}: {self.what}{self._others()} [{self.check}]\n    {self.do}"

    def _others(self) -> str:
        """Where else: lines of the same file by their numbers."""
        if not self.more or self.place is None:
            return ""
        shown = [
            f"line {place.line}"
            if place.file == self.place.file
            else f"{Path(place.file).name}:{place.line}"
            for place in self.more
        ]
        return f"; so also at {listed(shown)}"

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        return {
            "check": self.check,
            "weight": self.weight.value,
            "file": self.place.file if self.place else None,
            "line": self.place.line if self.place else None,
            "what": self.what,
            "do": self.do,
            "more": [{"file": place.file, "line": place.line} for place in self.more],
        }


def listed(names: Sequence[str]) -> str:
    """The first few, and how many more there are."""
    left_out = len(names) - _SHOWN
    return ", ".join([*names[:_SHOWN], *([f"{left_out} more"] if left_out > 0 else [])])


def in_order(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """The worst first; what is the same at several places becomes one finding."""
    places: dict[Finding, list[Place]] = {}
    for finding in findings:
        of_kind = places.setdefault(replace(finding, place=None), [])
        if finding.place is not None and finding.place not in of_kind:
            of_kind.append(finding.place)

    def where(place: Place) -> tuple[str, int]:
        return place.file, place.line

    found = []
    for finding, unsorted in places.items():
        ordered = sorted(unsorted, key=where)
        place = ordered[0] if ordered else None
        found.append(replace(finding, place=place, more=tuple(ordered[1:])))

    def order(finding: Finding) -> tuple[tuple[bool, int], tuple[str, int], str]:
        return finding.rank, where(finding.place) if finding.place else ("", 0), finding.check

    return tuple(sorted(found, key=order))
