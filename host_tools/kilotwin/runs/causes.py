"""Failures of programs by their causes: a crash of forty robots at one line is one."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from kilotwin.runs.event_places import uid_of

_NAMED = 3

MISTAKES = (
    "it divides by zero",
    "it reads by a pointer that is NULL or wild",
    "it writes by a pointer that is NULL or wild",
    "it uses a pointer that is NULL or wild",
    "it goes beyond its own variables",
    "it jumped to address 0",
    "it left its program",
    "its stack has grown down to its variables",
)
"""How the engine's notes begin of mistakes that nothing stops on the robot: those of
emulator/robots/translated/mistakes.cpp and emulator/robots/native/fault.cpp."""


@dataclass
class Cause:
    """A failure and where it came up: robots by their uids, or modules as "column-row".

    `file` is "" where no line is known. `first_tick` is that of the first of them.
    """

    what: str
    program: str
    file: str
    line: int
    first_tick: int
    whose: list[str] = field(default_factory=list)

    def text(self, kind: str) -> str:
        """`crash at walk.c:42 in loop(): ...: robots 3, 7, 12 and 40 more (walk), from tick 31`;
        `kind` is "robot" or "module"."""
        who = listed(kind, self.whose)
        return f"{self.what}: {who} ({self.program}), from tick {self.first_tick}"

    def as_dict(self, kind: str) -> dict[str, Any]:
        """For summaries: what is known, and how many there are."""
        row = {key: value for key, value in vars(self).items() if key != "whose"}
        return {**row, f"{kind}s": len(self.whose), f"first_{kind}": self.whose[0]}


def said(event: Mapping[str, Any]) -> str:
    """`crash at walk.c:42 in loop(): it ...`, of an event that knows its place; `crash: it ...`."""
    kind = str(event["kind"]).replace("_", " ")
    return f"{kind} {event['text']}" if "file" in event else f"{kind}: {event['text']}"


def is_mistake(event: Mapping[str, Any]) -> bool:
    """Whether it notes a mistake of a program, one of MISTAKES."""
    if event["kind"] != "note":
        return False
    text = str(event["text"])
    return any(text.startswith(one) or f": {one}" in text for one in MISTAKES)


def cause_key(event: Mapping[str, Any]) -> tuple[Any, ...]:
    """Equal for events of one cause: the same kind at the same line, or of the same text."""
    line = (event["file"], event["line"]) if event.get("file") else event["text"]
    return event.get("program", ""), event["kind"], line


def causes(events: Iterable[Mapping[str, Any]]) -> list[Cause]:
    """The causes of failures, in their order."""
    found: dict[tuple[Any, ...], Cause] = {}
    for event in events:
        named = uid_of(event) if "robot" in event else "-".join(map(str, event["module"]))
        cause = found.setdefault(
            cause_key(event),
            Cause(
                said(event),
                event.get("program", ""),
                event.get("file", ""),
                event.get("line", 0),
                event["tick"],
            ),
        )
        cause.first_tick = min(cause.first_tick, event["tick"])
        cause.whose.append(str(named))
    return list(found.values())


def listed(kind: str, whose: Sequence[str]) -> str:
    """`robot 3`, `robots 3 and 7`, `robots 3, 7, 12 and 40 more`."""
    if len(whose) == 1:
        return f"{kind} {whose[0]}"
    named = list(whose) if len(whose) <= _NAMED + 1 else list(whose[:_NAMED])
    last = f"{len(whose) - _NAMED} more" if len(named) < len(whose) else named.pop()
    return f"{kind}s {', '.join(named)} and {last}"


def robots_failed(events: Iterable[Mapping[str, Any]]) -> str:
    """The first cause of robots' failures, and how many more there are."""
    found = causes(events)
    more = f"; and {len(found) - 1} other causes" if len(found) > 1 else ""
    return found[0].text("robot") + more
