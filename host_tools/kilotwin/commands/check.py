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
from kilotwin.files import confinement
from kilotwin.files.junit import write_junit
from kilotwin.files.plain_text import plain
from kilotwin.files.sarif import write_sarif
from kilotwin.programs.port.trial import Trial
from kilotwin.studies.scenario import program_check as checks
from kilotwin.studies.scenario.runner import prepare, run_all
from kilotwin.studies.sweep.executors import Processes

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


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin check my.c\n\n"
    "  kilotwin check my.c --flash 20000 --sarif check.sarif --junit check.xml\n\n"
    "  kilotwin check main.c helpers.c -I include -D N=3 --json"
)
def check(
    program: Sources,
    *,
    include: Include = None,
    define: Define = None,
    flash: Flash = None,
    ram: Ram = None,
    stack: Stack = None,
    seconds: PortTime = 60,
    timeout: Timeout = 600,
    processes: TestProcesses = None,
    sarif: Sarif = None,
    junit: Junit = None,
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
    display = terminal.sweep_display(quiet)
    found = checks.program_of(program, include or [], define or [])
    steps: list[checks.Step] = []

    def take(step: checks.Step) -> None:
        steps.append(step)
        if not as_json:
            typer.echo(plain(step.text()))

    take(checks.on_this_computer(found, display.note))
    port, report = checks.on_the_chip(
        program, include or [], define or [], Trial(seconds, 1), display.note
    )
    take(port)
    if report is not None:
        take(checks.size(report, checks.Budget(flash, ram, stack)))
    if not steps[0].fails:
        files, unfit = checks.scenarios_beside(found)
        for step in unfit:
            take(step)
        scenarios = prepare(files, [], timeout, display.note)
        if scenarios:
            for scenario in run_all(scenarios, Processes(processes or cores()), display):
                take(checks.of_scenario(scenario))
    _write(steps, sarif, junit)
    fails = any(step.fails for step in steps)
    if as_json:
        typer.echo(json.dumps({"fails": fails, "steps": [step.as_dict() for step in steps]}))
    if fails:
        raise typer.Exit(1)


def _write(steps: Sequence[checks.Step], sarif: Path | None, junit: Path | None) -> None:
    if sarif is not None:
        results = [one.result() for step in steps for one in step.found]
        write_sarif(sarif, results, Path.cwd())
    if junit is not None:
        write_junit(junit, [step.suite() for step in steps])
