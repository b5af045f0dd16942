"""The processor of a program whose cpu is "auto": the robot's own machine code, where there can be
some."""

import os
import shutil
from collections.abc import Iterator

from kilotwin.experiment.programs import Program
from kilotwin.experiment.schema.experiment import Cpu, ProfileName

_TOOLS = ("avr-gcc", "avr-nm", "avr-ar", "avr-objcopy")
_START = b"kilo_start"
_TEXT = {".c", ".h", ".inc"}


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
    """Its sources, then what lies beside them and in its own folders of headers."""
    yield from (source.read_bytes() for source in program.sources)
    folders = dict.fromkeys([*(one.parent for one in program.sources), *program.include_folders])
    for folder in folders:
        for file in sorted(folder.iterdir()):
            if file.suffix in _TEXT and file.is_file() and os.access(file, os.R_OK):
                yield file.read_bytes()
