"""The processor of a program whose cpu is "auto": the robot's own machine code, where there can be
some."""

import os
import re
import shutil
from collections import deque
from collections.abc import Iterator
from pathlib import Path

from kilotwin.experiment.programs import Program
from kilotwin.experiment.schema.experiment import Cpu, ProfileName

_TOOLS = ("avr-gcc", "avr-nm", "avr-ar", "avr-objcopy")
_START = b"kilo_start"
_TEXT_OR_COMMENT = re.compile(rb'"(?:\\.|[^"\\\n])*"|//[^\n]*|/\*.*?\*/', re.DOTALL)
_INCLUDE = re.compile(rb'^[ \t]*#[ \t]*include[ \t]*["<]([^">\n]+)[">]', re.MULTILINE)


def processor_of(program: Program, cpu: Cpu, profile: ProfileName) -> tuple[Cpu, str]:
    """The processor, and why it is this computer where the robot's machine code is the rule; ""
    where it is not, or was asked for."""
    if cpu != "auto":
        return cpu, ""
    if profile != "kilobot":
        return "native", ""
    if lacks := missing_tool():
        return "native", lacks
    if not any(_START in text for text in _texts_of(program)):
        return "native", "it has no kilo_start(), where translated programs begin"
    return "translated", ""


def missing_tool() -> str:
    """A tool that builds for the ATmega328P and is not here, with what installs it; ""."""
    found = {tool: shutil.which(tool) for tool in _TOOLS}
    lacking = next((tool for tool, path in found.items() if path is None), "")
    remedy = "type: apt-get install gcc-avr avr-libc binutils-avr"
    return f"{lacking} is not here; {remedy}" if lacking else ""


def _texts_of(program: Program) -> Iterator[bytes]:
    """Its sources without comments, and those of their own files that they include: what else lies
    beside them is another program's."""
    waiting = deque(program.sources)
    known = set(waiting)
    while waiting:
        file = waiting.popleft()
        text = _TEXT_OR_COMMENT.sub(_without_comments, file.read_bytes())
        yield text
        for name in _INCLUDE.findall(text):
            included = _own_file(
                name.decode(errors="replace"), (file.parent, *program.include_folders)
            )
            if included is not None and included not in known:
                known.add(included)
                waiting.append(included)


def _without_comments(found: re.Match[bytes]) -> bytes:
    return found[0] if found[0].startswith(b'"') else b" "


def _own_file(name: str, folders: tuple[Path, ...]) -> Path | None:
    files = (folder / name for folder in folders)
    return next((file for file in files if file.is_file() and os.access(file, os.R_OK)), None)
