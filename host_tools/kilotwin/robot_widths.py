"""Gives a program's int and long the robot's widths, for programs that count on them.

On an AVR `int` is int16_t and `long` is int32_t, so that a function may be declared with one and
defined with the other. On a PC that does not compile.
"""

import re
from collections.abc import Sequence

_MARKER = re.compile(r'# \d+ "(.*?)"([ \d]*)$')
_SYSTEM_HEADER = "3"
_TEXT = r'"(?:\\.|[^"\\])*"|' + r"'(?:\\.|[^'\\])*'"
_TYPE = r"\b(?:unsigned|signed|short|long|int)\b(?:[ \t]+(?:unsigned|signed|short|long|int)\b)*"
_WORDS = re.compile(rf"{_TEXT}|{_TYPE}(?:[ \t]+(?:char|double)\b)?")


def with_robots_widths(preprocessed: str, headers: Sequence[str]) -> str:
    """C text as `cc -E` gives it, with int as short and long as int in what the program wrote.

    Files whose name begins as one of `headers`, and the compiler's own, are left alone: the thin
    half was compiled with them.
    """
    own = True
    lines = []
    for line in preprocessed.splitlines():
        marker = _MARKER.match(line)
        if marker:
            name, flags = marker.groups()
            own = _SYSTEM_HEADER not in flags and not name.startswith(tuple(headers))
        lines.append(_WORDS.sub(_robots_type, line) if own and not marker else line)
    return "\n".join([*lines, ""])


def _robots_type(match: re.Match[str]) -> str:
    words = match[0].split()
    if match[0][0] in "\"'" or {"char", "double", "short"} & {*words} or words.count("long") > 1:
        return match[0]
    sign = ["unsigned"] if "unsigned" in words else []
    return " ".join([*sign, "int" if "long" in words else "short"])
