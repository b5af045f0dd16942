"""Hand-ins: many programs for one task, each checked by itself, in one table."""

import csv
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import shorten
from typing import Any

from kilotwin.errors import InterruptError, KilotwinError
from kilotwin.studies.scenario.program_check import Found, How, Step, steps
from kilotwin.studies.sweep.runner import Display

_STEPS = ("build", "port", "size")
_REASON_WIDTH = 70
HEADS = ("program", *_STEPS, "scenarios", "result")


@dataclass
class HandIn:
    """A program, by the name that it was given, and what was found."""

    name: str
    steps: list[Step] = field(default_factory=list)

    @property
    def fails(self) -> bool:
        """Whether one of its steps does."""
        return any(step.fails for step in self.steps)

    @property
    def scenarios(self) -> list[Step]:
        """One of each scenario that it ran in."""
        return [step for step in self.steps if step.name == "scenario"]

    @property
    def reason(self) -> str:
        """The first error, in one line; "" if it passes."""
        errors = (one for step in self.steps for one in step.found if one.level == "error")
        first = next(errors, None)
        if first is None:
            return ""
        message = " ".join(first.message.split()).replace(f"{Path.cwd()}/", "")
        return f"{self._where(first)}{message} [{first.rule}]"

    def _where(self, found: Found) -> str:
        """`line 24: ` of the program's only file, else with the file's name."""
        if found.file is None:
            return ""
        file, line = Path(found.file).resolve(), f"{found.line}: " if found.line else ""
        if line and file == Path(self.name).resolve():
            return f"line {line}"
        here = Path.cwd()
        shown = file.relative_to(here) if file.is_relative_to(here) else file
        return f"{shown}:{line or ' '}"

    def row(self) -> tuple[str, ...]:
        """A text for each of HEADS; "-" for what was not looked at."""
        by_name = {step.name: "FAIL" if step.fails else "ok" for step in self.steps}
        ran = self.scenarios
        met = f"{sum(not step.fails for step in ran)} of {len(ran)}" if ran else "-"
        why = shorten(self.reason, _REASON_WIDTH, placeholder=" ...")
        result = f"FAILS {why}" if self.fails else "passes"
        return (self.name, *(by_name.get(name, "-") for name in _STEPS), met, result)

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        rows = [step.as_dict() for step in self.steps]
        return {"program": self.name, "fails": self.fails, "steps": rows}


def check_each(
    written: Sequence[str], how: How, display: Display, note: Callable[[str], None]
) -> Iterator[HandIn]:
    """Each when it was looked at. What is wrong with one stops no other."""
    for number, name in enumerate(written, 1):
        note(f"{number} of {len(written)}: {name}")
        one = HandIn(name)
        try:
            one.steps += steps([name], how, display, lambda _: None)
        except InterruptError:
            raise
        except KilotwinError as error:
            one.steps.append(Step("check", "", [Found("check", "error", str(error))]))
        yield one


def table(found: Sequence[HandIn]) -> str:
    """A line each, and a summary."""
    rows = [HEADS, *(one.row() for one in found)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(HEADS))]
    lines = [
        "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    fails = sum(one.fails for one in found)
    return "\n".join([*lines, f"{len(found)} programs: {len(found) - fails} pass, {fails} fail"])


def write_csv(found: Sequence[HandIn], file: Path) -> None:
    """The table for a spreadsheet: the scenarios met and all of them in two columns, reasons
    whole."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("w", encoding="utf-8", newline="") as target:
        writer = csv.writer(target)
        writer.writerow(("program", "passes", *_STEPS, "scenarios_met", "scenarios", "reason"))
        for one in found:
            name, *looked_at, _, _ = one.row()
            met = sum(not step.fails for step in one.scenarios)
            passes = "no" if one.fails else "yes"
            writer.writerow((name, passes, *looked_at, met, len(one.scenarios), one.reason))
