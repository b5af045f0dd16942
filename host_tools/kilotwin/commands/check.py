"""`kilotwin check`: all that a lab's CI asks of a program."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands import terminal
from kilotwin.commands.options import (
    ConfineMode,
    Define,
    Include,
    Json,
    Quiet,
    Sources,
    Trust,
    command_app,
)
from kilotwin.commands.test import Junit, TestProcesses, Timeout, cores
from kilotwin.errors import InputError
from kilotwin.files import confinement
from kilotwin.files.junit import Suite, write_junit
from kilotwin.files.plain_text import plain
from kilotwin.files.sarif import write_sarif
from kilotwin.programs.port.trial import Trial
from kilotwin.studies.pool.places import Processes
from kilotwin.studies.scenario import hand_ins
from kilotwin.studies.scenario import program_check as checks
from kilotwin.studies.scenario.runner import find

app = command_app()

Sarif = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Also write the findings as SARIF, for annotations on the lines.",
    ),
]
PortTime = Annotated[
    float,
    typer.Option(
        "--time",
        min=1,
        max=86400,
        help="Simulated seconds to run it for on the chip.",
    ),
]
Flash = Annotated[
    int | None,
    typer.Option("--flash", metavar="BYTES", min=1, help="Its budget of flash."),
]
Ram = Annotated[
    int | None,
    typer.Option("--ram", metavar="BYTES", min=1, help="Its budget of variables."),
]
Stack = Annotated[
    int | None,
    typer.Option("--stack", metavar="BYTES", min=1, help="Its budget of stack."),
]

Each = Annotated[
    bool,
    typer.Option("--each", help="Each name is a program of its own, as hand-ins are: a table."),
]
Tasks = Annotated[
    list[Path] | None,
    typer.Option(
        "--scenarios",
        metavar="FILE",
        help="Scenarios, or folders of them, in which it takes the place of the robots' program; "
        "instead of those in its folder.",
    ),
]
Csv = Annotated[
    Path | None, typer.Option("--csv", metavar="FILE", help="--each: also write the table as CSV.")
]


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin check my.c\n\n"
    "  kilotwin check my.c --flash 20000 --sarif check.sarif --junit check.xml\n\n"
    "  kilotwin check main.c helpers.c -I include -D N=3 --json\n\n"
    "  kilotwin check --each hand-ins/*.c --scenarios task.toml --csv marks.csv"
)
def check(
    program: Sources,
    *,
    include: Include = None,
    define: Define = None,
    flash: Flash = None,
    ram: Ram = None,
    stack: Stack = None,
    each: Each = False,
    tasks: Tasks = None,
    seconds: PortTime = 60,
    timeout: Timeout = 600,
    processes: TestProcesses = None,
    sarif: Sarif = None,
    junit: Junit = None,
    csv: Csv = None,
    confine: ConfineMode = None,
    trust: Trust = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Build a program for PC and robot, look for what goes wrong there, run its scenarios.

    1 if something fails. Scenarios are the experiments with \\[\\[expect]] in the program's folder
    and below whose robots run it.
    """
    confinement.choose(confine, trust)
    if csv is not None and not each:
        raise InputError("--csv: is the table of --each; add --each")
    display = terminal.sweep_display(quiet)
    how = checks.How(
        include or [],
        define or [],
        checks.Budget(flash, ram, stack),
        Trial(seconds, 1),
        find(tasks) if tasks else (),
        timeout,
        Processes(processes or cores()),
    )
    if each:
        silent = terminal.SweepSilent()
        handed_in = list(hand_ins.check_each(program, how, silent, display.note))
        _write([(one.name, one.steps) for one in handed_in], sarif, junit)
        if csv is not None:
            hand_ins.write_csv(handed_in, csv)
        fails = any(one.fails for one in handed_in)
        rows = [one.as_dict() for one in handed_in]
        told = {"fails": fails, "programs": rows}
        typer.echo(json.dumps(told) if as_json else plain(hand_ins.table(handed_in)))
        raise typer.Exit(int(fails))
    steps: list[checks.Step] = []
    for step in checks.steps(program, how, display, display.note):
        steps.append(step)
        if not as_json:
            typer.echo(plain(step.text()))
    _write([("", steps)], sarif, junit)
    fails = any(step.fails for step in steps)
    if as_json:
        typer.echo(json.dumps({"fails": fails, "steps": [step.as_dict() for step in steps]}))
    if fails:
        raise typer.Exit(1)


def _write(
    programs: Sequence[tuple[str, Sequence[checks.Step]]], sarif: Path | None, junit: Path | None
) -> None:
    """Names of programs, "" for the only one, with their steps."""
    steps = [step for _, its in programs for step in its]
    if sarif is not None:
        results = [one.result() for step in steps for one in step.found]
        write_sarif(sarif, results, Path.cwd())
    if junit is not None:
        suites = [(name, step.suite()) for name, its in programs for step in its]
        named = [Suite(f"{name} {one.name}".strip(), one.cases) for name, one in suites]
        write_junit(junit, named)
