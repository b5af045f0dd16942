"""Errors of programs that cannot be built: in their own terms, not in those of our builds."""

import re
from collections.abc import Sequence
from pathlib import Path

from kilotwin.errors import InputError
from kilotwin.experiment.programs import Program
from kilotwin.programs.apis import APIS, defined_symbols, missing_symbols

TARGETS = {"robot": "a robot", "module": "a Kilogrid module"}
"""Names of the targets in messages."""

ENGLISH = {"LC_ALL": "C"}
"""Environment of the linker, whose messages are parsed here."""

# `lost.c:4: undefined reference to `fly'`, with a section and an offset where no line is known.
_UNDEFINED = re.compile(
    r"^(?:\S*ld: )?(?:(.+):)?(?:(\d+)|\(.+\)): undefined reference to [`'](.+)'$", re.MULTILINE
)


def check_main(program: Program, nm: str, objects: Sequence[Path], symbol: str = "main") -> None:
    """InputError unless one of the program's `objects`, one for each source, has its main().

    `symbol` is what main() is called in there.
    """
    having = [
        source.name
        for source, compiled in zip(program.sources, objects, strict=True)
        if symbol in defined_symbols(nm, [compiled])
    ]
    if not having:
        raise InputError(
            f"{program.written}: has no main(); add the one that every program needs: it calls "
            f"{APIS[program.api].start}"
        )
    if len(having) > 1:
        raise InputError(
            f"{program.written}: {' and '.join(having)} each have a main(); these are several "
            "programs, name the files of one"
        )


def explained(error: InputError, program: Program, nm: str, objects: Sequence[Path]) -> InputError:
    """The linker's message on the program's `objects`; in our words where a symbol is missing."""
    found = list(dict.fromkeys(_UNDEFINED.findall(error.detail)))
    names: dict[str, None] = {}
    places = []
    for source, compiled in zip(program.sources, objects, strict=True):
        wanted = missing_symbols(nm, [compiled])
        for symbol in dict.fromkeys(name for _, _, name in found if name in wanted):
            names[symbol] = None
            at = [
                f":{line}"
                for file, line, name in found
                if name == symbol and line and Path(file).name == source.name
            ]
            places += [f"{source}{line}: undefined reference to '{symbol}'" for line in at or [""]]
    if not names:
        return error
    from kilotwin.programs.native.guest import suggestions

    meant = [near for name, near in suggestions(program).items() if name in names]
    instead = f"did you mean {', '.join(meant)}? Else write" if meant else "write"
    return InputError(
        f"{program.written}: neither the program nor the API has {', '.join(names)}; {instead} "
        "what is missing, or add the file that has it",
        detail="\n".join(places),
    )


def wrong_target(program: Program) -> InputError | None:
    """The error of a program that looks like one for the other target; None if it does not."""
    target = program.looks_like
    if target is None or target == program.target:
        return None
    add = "add --for module" if target == "module" else "leave out --for module"
    return InputError(
        f"{program.written}: is a program for {TARGETS[target]}, not for "
        f"{TARGETS[program.target]}; {add}"
    )
