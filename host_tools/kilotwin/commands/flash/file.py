"""The FILE of `kilotwin flash`: a .hex, or a program that is built first if it would run."""

from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands import steps
from kilotwin.errors import InputError, RunError
from kilotwin.experiment.programs import HEX_SUFFIXES, Api, Program, ProgramError, find_program
from kilotwin.programs.image.image import build_image
from kilotwin.programs.linking import wrong_target

File = Annotated[
    Path, typer.Argument(metavar="FILE", help="A .hex; or a .c or a folder, to be built first.")
]
Force = Annotated[
    bool,
    typer.Option("--force", help="Also what `kilotwin port` says would fail."),
]
Display = steps.Lines | steps.Bar


def is_built(
    file: Path, include: list[str] | None, define: list[str] | None, api: Api | None = None
) -> bool:
    """Whether it is a .hex; InputError if options for building go with it, or if it is neither
    that nor a program for `api`."""
    built = file.suffix.lower() in HEX_SUFFIXES
    if built and (include or define):
        raise InputError(f"{file} is built already; -I and -D are for a .c or a folder")
    if not built:
        program = _program_of(file, include or [], define or [], api)
        if wrong := wrong_target(program):
            raise wrong
    return built


def hex_of(
    file: Path,
    include: list[str] | None,
    define: list[str] | None,
    *,
    force: bool,
    display: Display,
    api: Api | None = None,
) -> Path:
    """FILE itself if it is a .hex, else that of the program, if `kilotwin port` lets it pass.

    `api`: that of modules, of whose programs `port` knows the size alone. InputError if options for
    building go with a .hex.
    """
    if is_built(file, include, define, api):
        return file
    return _build(file, include or [], define or [], force=force, display=display, api=api)


def _program_of(file: Path, include: list[str], define: list[str], api: Api | None) -> Program:
    try:
        return find_program([str(file)], Path.cwd(), include, define, api)
    except ProgramError as error:
        raise InputError(f"{error}, or a .hex") from None


def _build(
    file: Path,
    include: list[str],
    define: list[str],
    *,
    force: bool,
    display: Display,
    api: Api | None,
) -> Path:
    program = _program_of(file, include, define, api)
    image = build_image(program, display.step)
    if not force:
        from kilotwin.programs.port.trial import Trial

        trial = None if api == "module" else Trial()
        from kilotwin.programs.port.check import check

        report = check([str(file)], include, define, trial, display.step, api=api)
        if report.fails:
            where = "module" if api == "module" else "robot"
            raise RunError(
                f"{file} would fail on the {where}; mend it, or type --force. Nothing was written",
                detail=report.text(),
            )
    return image.hex
