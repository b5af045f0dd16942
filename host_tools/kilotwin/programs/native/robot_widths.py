"""Gives a program's int and long the robot's widths, for programs that count on them.

On an AVR `int` is int16_t and `long` is int32_t, so that a function may be declared with one and
defined with the other. On a PC that does not compile.
"""

import re
from collections.abc import Callable, Sequence
from itertools import groupby

MARKER = re.compile(r'# \d+ "(.*)"([ \d]*)$', re.MULTILINE)
"""The preprocessor's line that says whose lines come next: the file's name, and flags."""
_BEFORE_MARKER = re.compile(r'^(?=# \d+ ")', re.MULTILINE)
_SYSTEM_HEADER = "3"
TEXT = r'"(?:\\.|[^"\\\n])*"|' + r"'(?:\\.|[^'\\\n])*'"
"""A string or a character, as an expression."""
_TYPE = r"\b(?:unsigned|signed|short|long|int)\b(?:[ \t]+(?:unsigned|signed|short|long|int)\b)*"
_WORDS = re.compile(rf"{TEXT}|{_TYPE}(?:[ \t]+(?:char|double)\b)?")


def with_robots_widths(preprocessed: str, headers: Sequence[str]) -> str:
    """C text as `cc -E` gives it, with int as short and long as int in what the program wrote.

    Files whose name begins as one of `headers`, and the compiler's own, are left alone: the thin
    half was compiled with them.
    """
    return change_own_lines(preprocessed, headers, lambda lines: _WORDS.sub(_robots_type, lines))


def change_own_lines(
    preprocessed: str, headers: Sequence[str], change: Callable[[str], str]
) -> str:
    """C text as `cc -E` gives it, with `change` made to what the program wrote, in pieces.

    Left alone are files whose name begins as one of `headers`, and the compiler's own. A piece may
    hold markers, which the preprocessor also puts behind comments and system headers' macros.
    """
    chunks = _BEFORE_MARKER.split(preprocessed)
    pieces = groupby(chunks, lambda chunk: _is_own(chunk, tuple(headers)))
    return "".join(change("".join(piece)) if own else "".join(piece) for own, piece in pieces)


def _is_own(chunk: str, headers: tuple[str, ...]) -> bool:
    """Whether the program wrote it, by the marker that it begins with."""
    marker = MARKER.match(chunk)
    if not marker:
        return True
    name, flags = marker.groups()
    return _SYSTEM_HEADER not in flags and not name.startswith(headers)


def _robots_type(match: re.Match[str]) -> str:
    words = match[0].split()
    if match[0][0] in "\"'" or {"char", "double", "short"} & {*words} or words.count("long") > 1:
        return match[0]
    sign = ["unsigned"] if "unsigned" in words else []
    return " ".join([*sign, "int" if "long" in words else "short"])
