"""Errors of programs that cannot be built: in their own terms, not in those of our builds."""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from kilotwin.errors import InputError
from kilotwin.experiment.programs import Program
from kilotwin.programs.apis import APIS, defined_symbols, missing_symbols

TARGETS = {"robot": "a robot", "module": "a Kilogrid module"}
"""Names of the targets in messages."""

ENGLISH = {"LC_ALL": "C"}
"""Environment of the linker, whose messages are parsed here."""

_MS = "delay(1000) waits 1,000 ms; a loop() that compares kilo_ticks, 31 a second, does not block"
_TICKS = "kilo_ticks counts 31 a second"
_CHANCE = "rand_soft() and rand_hard() give a byte, rand() of stdlib.h an int"
_ARDUINO = "that is Arduino's: a Kilobot has set_color(), set_motors() and kilo_ticks"
# The robot's piece in place of each that a PC, or another board, has.
_INSTEAD = {
    **dict.fromkeys(("sleep", "usleep", "nanosleep", "msleep", "thrd_sleep"), _MS),
    **dict.fromkeys(("delayMicroseconds", "wait_ms", "delay_ms"), _MS),
    **dict.fromkeys(("clock", "gettimeofday", "clock_gettime", "millis", "micros"), _TICKS),
    **dict.fromkeys(("drand48", "srand48", "lrand48", "arc4random", "getrandom"), _CHANCE),
    **dict.fromkeys(("digitalWrite", "digitalRead", "analogRead", "pinMode"), _ARDUINO),
}

# `lost.c:4: undefined reference to `fly'`, with a section and an offset where no line is known.
_UNDEFINED = re.compile(
    r"^(?:\S*ld: )?(?:(.+):)?(?:(\d+)|\(.+\)): undefined reference to [`'](.+)'$", re.MULTILINE
)

_MISSING_HEADER = re.compile(
    r"fatal error: '?([^:'\n]+)'?(?:: No such file or directory| file not found)"
)
# Headers that labs keep beside their programs, by where they are found.
_KEPT = {
    "agent.h": "an ARGoS project keeps it beside its behaviours",
    "communication.h": "an experiment's folder keeps it above those of its robot and module",
}
_IN_SIMULATOR = re.compile(r"argos3?/|\.hpp$")


def missing_header(said: str) -> str:
    """The end of an error whose compiler did not find a header: which, and what to do; else ""."""
    found = _MISSING_HEADER.search(said)
    if found is None:
        return ""
    header = found[1]
    if _IN_SIMULATOR.search(header):
        return f"; {header} is a simulator's own, in C++: leave out what needs it, by #ifdef"
    kept = _KEPT.get(Path(header).name)
    where = f" ({kept})" if kept else ""
    return (
        f"; there is no {header}{where}: put it beside the program, or name its folder, by -I or "
        "in an experiment by include"
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


def check_absent(program: Program, nm: str, objects: Sequence[Path]) -> None:
    """InputError if the program calls what this PC has, and a robot has not, as sleep()."""
    wanted = missing_symbols(nm, objects) - defined_symbols(nm, objects)
    if absent := _absent(program, sorted(wanted)):
        raise InputError(absent)


def _absent(program: Program, names: Iterable[str]) -> str:
    """The target's pieces in place of some of these; "" if it is known of none."""
    known = [name for name in names if name in _INSTEAD]
    if not known:
        return ""
    instead = "; ".join(dict.fromkeys(_INSTEAD[name] for name in known))
    return f"{program.written}: {TARGETS[program.target]} has no {', '.join(known)}(): {instead}"


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
    if absent := _absent(program, names):
        return InputError(absent, detail="\n".join(places))
    from kilotwin.programs.native.look import suggestions

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
