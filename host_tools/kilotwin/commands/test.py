"""`kilotwin test`: experiments that say what is to come of them."""

import json
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from kilotwin.commands import terminal
from kilotwin.commands.options import (
    ConfineMode,
    Json,
    Quiet,
    Settings,
    Trust,
    command_app,
    given_settings,
)
from kilotwin.commands.run import Sanitize
from kilotwin.errors import EXIT_TIMEOUT, InputError, KilotwinError
from kilotwin.files import confinement
from kilotwin.files.junit import write_junit
from kilotwin.files.plain_text import plain
from kilotwin.programs.native.sanitizer import ONE_OF_BOTH
from kilotwin.studies.pool.places import Processes
from kilotwin.studies.scenario import report
from kilotwin.studies.scenario.one_run import with_seed
from kilotwin.studies.scenario.runner import Scenario, find, prepare, run_all

app = command_app()

Files = Annotated[
    list[Path] | None,
    typer.Argument(
        help="Experiments with \\[\\[expect]], or folders of them; all below this one if not given."
    ),
]
Junit = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Also write what came of it as JUnit XML."),
]
Timeout = Annotated[
    float,
    typer.Option(
        metavar="SECONDS",
        min=0.1,
        max=1e6,
        envvar="KILOTWIN_TEST_TIMEOUT",
        help="Wall time that a run may take.",
    ),
]
TestProcesses = Annotated[
    int | None,
    typer.Option("-j", "--processes", min=1, help="All cores if not given."),
]
Keep = Annotated[
    bool,
    typer.Option(
        help="Run what failed once more into runs/failed/NAME-seedN, with a map.",
    ),
]
Coverage = Annotated[
    Path | None,
    typer.Option(
        "--coverage",
        metavar="FOLDER",
        envvar="KILOTWIN_TEST_COVERAGE",
        help="Run programs by their machine code, and write which of their lines have run in any "
        "run into this folder.",
    ),
]
Video = Annotated[bool, typer.Option("--video", help="With a video too: run.mp4.")]


@app.command(
    "test",
    epilog="Examples:\n\n"
    "  kilotwin test\n\n"
    "  kilotwin test gather.toml --junit report.xml\n\n"
    "  kilotwin test scenarios --set swarm.cpu=avr --timeout 60\n\n"
    "  kilotwin test --coverage coverage\n\n"
    "  kilotwin test --sanitize\n\n"
    "Exit codes: 0 all met, 1 not met, 2 bad input, 124 a run took too long and all else was met.",
)
def run_scenarios(
    files: Files = None,
    *,
    settings: Settings = None,
    junit: Junit = None,
    timeout: Timeout = 600,
    processes: TestProcesses = None,
    keep: Keep = True,
    video: Video = False,
    coverage: Coverage = None,
    sanitize: Sanitize = False,
    confine: ConfineMode = None,
    trust: Trust = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run scenarios: experiments with expectations. Exits 1 if one fails."""
    confinement.choose(confine, trust)
    display = terminal.sweep_display(quiet)
    if sanitize and coverage is not None:
        raise InputError(ONE_OF_BOTH)
    found = find(files or [])
    given, covered = given_settings(settings, None), coverage is not None
    scenarios = prepare(found, given, timeout, display.note, covered=covered, sanitized=sanitize)
    width = max(len(scenario.name) for scenario in scenarios)
    for scenario in run_all(scenarios, Processes(processes or cores()), display):
        if not as_json:
            typer.echo(plain(report.row(scenario, width)))
    for scenario in scenarios:
        if keep and scenario.failures:
            _keep(scenario, timeout, video, quiet, shown=not as_json)
    if junit is not None:
        write_junit(junit, [report.suite(scenario) for scenario in scenarios])
    told = None if coverage is None else _cover(scenarios, coverage)
    if as_json:
        rows = {"scenarios": [report.as_dict(one) for one in scenarios]}
        typer.echo(json.dumps(rows if told is None else {**rows, "coverage": told}))
    else:
        typer.echo(plain(report.summary_text(scenarios)))
        if told is not None:
            typer.echo(f"coverage: {told['text']}\n{terminal.coverage_text(told)}")
    failed = [scenario for scenario in scenarios if scenario.failures]
    if failed:
        raise typer.Exit(EXIT_TIMEOUT if all(one.timed_out for one in failed) else 1)


def _cover(scenarios: list[Scenario], folder: Path) -> dict[str, Any]:
    """Writes what has run in any run of any of them; what --json says of it."""
    from kilotwin.programs.coverage import report as written

    marks = [
        pair
        for scenario in scenarios
        for ran in scenario.ran.values()
        for pair in written.own_marks(scenario.experiment, ran.marks)
    ]
    return dict(written.written(written.of_programs(marks), folder))


def _keep(scenario: Scenario, timeout_s: float, video: bool, quiet: bool, *, shown: bool) -> None:
    seed = next((one.seed for one in scenario.failures if one.seed is not None), None)
    if seed is None or scenario.timed_out:
        return
    again = with_seed(scenario.experiment, seed)
    from kilotwin.studies.scenario.kept_failures import keep

    scenario.folder = keep(again, sys.argv, timeout_s)
    if scenario.folder is not None:
        try:
            from kilotwin.studies.scenario.pictures import draw

            draw(scenario.folder, video=video)
        except (KilotwinError, ModuleNotFoundError) as error:
            terminal.sweep_display(quiet).note(f"{scenario.folder}: no picture of it: {error}")
    if shown and scenario.folder is not None:
        typer.echo(plain(f"{scenario.name}:\n{report.look_text(scenario)}"))


def cores() -> int:
    """Those that this process may use."""
    return len(os.sched_getaffinity(0))
