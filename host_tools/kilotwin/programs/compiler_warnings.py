"""A compiler's warnings of a program's own files. Our headers are not the user's to mend."""

import re
from collections.abc import Iterator
from pathlib import Path

from kilotwin.experiment.programs import Program

FLAGS = ("-Wall", "-Wextra", "-Wno-unused-parameter")
"""Callbacks of the API have parameters that few programs need."""

_MOST_SHOWN = 20
_DIAGNOSTIC = re.compile(r"^(.+?):\d+:(?:\d+:)? (warning|error|note|fatal error): ")
# Lines before a diagnostic: where its file was included, and in which function it is.
_CONTEXT = re.compile(r"^(In file included from |\s+from )|: (In |At top level)")


def own_warnings(program: Program, said: str) -> list[str]:
    """Warnings in what a compiler said, each with the lines that belong to it; once each."""
    return list(dict.fromkeys(_of_files(said, _folders_of(program))))


def shown(warnings: list[str]) -> str:
    """All of them, or the first with the number of the others."""
    more = len(warnings) - _MOST_SHOWN
    rest = [f"{more} more warnings"] if more > 0 else []
    return "\n".join([*warnings[:_MOST_SHOWN], *rest])


def _folders_of(program: Program) -> list[Path]:
    folders = [*(source.parent for source in program.sources), *program.include_folders]
    return [folder.resolve() for folder in folders]


def _of_files(said: str, folders: list[Path]) -> Iterator[str]:
    block: list[str] = []
    for line in said.splitlines():
        found = _DIAGNOSTIC.match(line)
        if (found and found[2] != "note") or _CONTEXT.search(line):
            if block:
                yield "\n".join(block)
            is_own = found and found[2] == "warning" and _is_below(folders, found[1])
            block = [line] if is_own else []
        elif block:
            block.append(line)
    if block:
        yield "\n".join(block)


def _is_below(folders: list[Path], file: str) -> bool:
    path = Path(file).resolve()
    return any(path.is_relative_to(folder) for folder in folders)
