"""`kilotwin bench`: how fast the engine is."""

import json
import os
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from kilotwin.commands import steps
from kilotwin.commands.options import Json, Quiet, command_app
from kilotwin.errors import EXIT_INTERRUPTED, InterruptError
from kilotwin.programs.translate.translation import OPTIMISED
from kilotwin.studies.bench import measure, two_engines

app = command_app()


class Workload(StrEnum):
    """Workloads of `bench`."""

    paper = "paper"
    walk = "walk"
    dense = "dense"
    silent = "silent"
    seldom = "seldom"
    period = "period"
    waits = "waits"
    delays = "delays"
    computes = "computes"
    state_1500 = "state-1500"
    programs_10 = "programs-10"
    slow = "slow"
    squeeze = "squeeze"
    transport = "transport"
    million = "million"
    memory = "memory"
    grid = "grid"
    avr = "avr"


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin bench paper --repeats 5 --json\n\n"
    "  kilotwin bench million --repeats 1\n\n"
    "  kilotwin bench walk --against ../kilotwin-before"
)
def bench(
    workloads: Annotated[
        list[Workload] | None,
        typer.Argument(help="What to measure; all if none is named."),
    ] = None,
    *,
    repeats: Annotated[
        int,
        typer.Option(min=1, help="Runs of each; the median counts."),
    ] = 3,
    duration_s: Annotated[
        float | None,
        typer.Option(help="Simulated seconds in place of whole trials."),
    ] = None,
    against: Annotated[
        Path | None,
        typer.Option(
            help="Another checkout, set up: run its engine and this one in turns.",
        ),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Measure robot-seconds per CPU-second, on one core or on several."""
    names = [one.value for one in workloads or Workload]
    note = steps.note(quiet)
    results: list[dict[str, Any]] = []
    interrupted = False
    before = os.environ.get(OPTIMISED)
    os.environ[OPTIMISED] = "1"  # each run is of the same code
    try:
        if against is None:
            table_text = measure.table_text
            results.extend(measure.measure(names, repeats, duration_s, note))
        else:
            table_text = two_engines.table_text
            results.extend(two_engines.measure(names, against, repeats, duration_s, note))
    except (InterruptError, KeyboardInterrupt):
        interrupted = True
    finally:
        os.environ.pop(OPTIMISED)
        if before is not None:
            os.environ[OPTIMISED] = before
    if results or as_json:
        typer.echo(json.dumps(results, indent=2) if as_json else table_text(results))
    if interrupted:
        typer.echo("interrupted; only what was measured in full is shown", err=True)
        raise typer.Exit(EXIT_INTERRUPTED)
