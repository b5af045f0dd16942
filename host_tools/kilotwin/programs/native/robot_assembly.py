"""Leaves out what only the AVR's compiler understands, for programs that else do not compile.

That is assembly but for what the emulator's headers know, and attributes of interrupt handlers.
"""

import re
from collections.abc import Callable, Sequence

from kilotwin.programs.native.robot_widths import MARKER, TEXT, change_own_lines

_ASSEMBLY = re.compile(
    rf"{TEXT}|\b(?:asm|__asm|__asm__)\b\s*(?:(?:volatile|__volatile|__volatile__|goto)\b\s*)*(?=\()"
)
_ATTRIBUTES = re.compile(rf"{TEXT}|\b(?:__attribute|__attribute__)\b\s*(?=\()")
_HANDLER = re.compile(r"\b(?:interrupt|__interrupt__|signal|__signal__)\b")
_PARENTHESES = re.compile(rf"{TEXT}|[()]")
# With it a program starts again, here as there.
_JUMP_TO_0 = re.compile(r'\(\s*"\s*jmp\s+0(x0+)?\s*"\s*\)')


def without_assembly(preprocessed: str, headers: Sequence[str]) -> str:
    """C text as `cc -E` gives it, without the assembly in what the program wrote.

    What an instruction would have set keeps what it had. Files whose name begins as one of
    `headers`, and the compiler's own, are left alone.
    """

    def change(lines: str) -> str:
        return _change(_change(lines, _ASSEMBLY, _no_assembly), _ATTRIBUTES, _no_handler)

    return change_own_lines(preprocessed, headers, change)


def _no_assembly(words: str, parentheses: str) -> str:
    if _JUMP_TO_0.fullmatch(parentheses):
        return words + parentheses
    *lines, _ = (words + parentheses).split("\n")
    return "".join(f"{line}\n" if MARKER.match(line) else "\n" for line in lines)


def _no_handler(words: str, parentheses: str) -> str:
    return words + _HANDLER.sub("unused", parentheses)


def _change(lines: str, beginning: re.Pattern[str], change: Callable[[str, str], str]) -> str:
    """With `change` made to each `beginning` and the parentheses after it."""
    parts, at = [], 0
    while found := beginning.search(lines, at):
        parts.append(lines[at : found.start()])
        at = found.end()
        if found[0][0] in "\"'":
            parts.append(found[0])
            continue
        end = _end_of_parentheses(lines, at)
        parts.append(change(found[0], lines[at:end]))
        at = end
    return "".join([*parts, lines[at:]])


def _end_of_parentheses(lines: str, start: int) -> int:
    depth = 0
    for found in _PARENTHESES.finditer(lines, start):
        depth += {"(": 1, ")": -1}.get(found[0], 0)
        if depth == 0:
            return found.end()
    return len(lines)
