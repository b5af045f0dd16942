"""The compiler's words on a program's own files, beside its native build, which is quiet: labs'
files are as avr-gcc 5 takes them."""

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from kilotwin.experiment.programs import Program
from kilotwin.programs import compiler_warnings

if TYPE_CHECKING:
    from kilotwin.programs.native.guest import Builder

_SUGGESTION = re.compile(r"implicit declaration of function '(\w+)'.*did you mean '(\w+)'")


def suggestions(program: Program) -> dict[str, str]:
    """Names that the compiler suggests for undeclared functions, by these; none of a compiler that
    suggests nothing."""
    from kilotwin.programs.native.guest import Builder, compiler_version, find_compiler

    compiler = find_compiler()
    builder = Builder(program, compiler, compiler_version(compiler))
    said = builder.said_of("implicit-function-declaration", "-fsyntax-only")
    return dict(_SUGGESTION.findall(said))


def note_missing_returns(program: Program, builder: "Builder", guest: Path) -> None:
    """Keeps what missing_returns() says of a guest that has just been built."""
    said = builder.said_of("return-type", "-S", "-o", os.devnull)
    missing = compiler_warnings.own_warnings(program, said)
    if missing:
        _kept_beside(guest).write_text(compiler_warnings.shown(missing))


def missing_returns(guest: Path) -> str:
    """Functions of a guest's program that end without the value that they promise: on the robot it
    is whatever a register holds, here another. "" if there are none."""
    kept = _kept_beside(guest)
    return kept.read_text() if kept.is_file() else ""


def _kept_beside(guest: Path) -> Path:
    return guest.with_suffix(".warnings")
