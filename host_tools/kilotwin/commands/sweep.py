"""`kilotwin sweep`: many experiments into one data set."""

import json
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands import terminal
from kilotwin.commands.options import (
    ConfineMode,
    Json,
    NoTwin,
    Quiet,
    RequireTwin,
    Trust,
    command_app,
    given_settings,
)
from kilotwin.errors import InputError
from kilotwin.files import confinement
from kilotwin.files.plain_text import plain
from kilotwin.programs.port.twin import chosen
from kilotwin.studies.pool.pool import Pool
from kilotwin.studies.sweep.plan import read_plan
from kilotwin.studies.sweep.report import listing_text, summary_text
from kilotwin.studies.sweep.runner import Sweep, default_folder
from kilotwin.studies.sweep.slurm import choose_place

app = command_app()

NumberOfProcesses = Annotated[
    int | None,
    typer.Option("-j", "--processes", min=1, help="All cores if not given."),
]
DaskAddress = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Run on the Dask cluster with its scheduler there.",
    ),
]
UseSlurm = Annotated[
    bool,
    typer.Option("--slurm", help="Run in jobs of Slurm, as \\[slurm] says."),
]
Seeds = Annotated[
    int | None,
    typer.Option(min=1, help="In place of the file's numbers."),
]
TrialTimeout = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        min=0.001,
        max=1e9,
        help="Stop a trial that takes longer, in place of the file's trial_timeout_s.",
    ),
]
AllSettings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set any key of all experiments; repeatable.",
    ),
]
DataFolder = Annotated[
    Path | None,
    typer.Option(help="The folder of the data set; runs/sweep-NAME if not given."),
]
Listing = Annotated[
    bool,
    typer.Option(
        "--list",
        help="Only list the trials and whether they are there already.",
    ),
]
Resume = Annotated[
    bool,
    typer.Option(
        help="Go on where it was stopped, or want a folder without trials.",
    ),
]


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin sweep experiments/paper/grid.toml -j 2\n\n"
    "  kilotwin sweep my.toml --seeds 2 --set duration_s=600 --list\n\n"
    "  kilotwin sweep my.toml --dask tcp://head-node:8786"
)
def sweep(
    file: Annotated[Path, typer.Argument(metavar="SWEEP", help="The sweep's TOML file.")],
    *,
    processes: NumberOfProcesses = None,
    dask: DaskAddress = None,
    slurm: UseSlurm = False,
    seeds: Seeds = None,
    settings: AllSettings = None,
    out: DataFolder = None,
    trial_timeout: TrialTimeout = None,
    confine: ConfineMode = None,
    trust: Trust = False,
    require_twin: RequireTwin = False,
    no_twin: NoTwin = False,
    listing: Listing = False,
    resume: Resume = True,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run an experiment many times, varied, into one data set. Goes on where it was stopped."""
    confinement.choose(confine, trust)
    twin = chosen(require=require_twin, without=no_twin)
    if dask and slurm:
        raise InputError("--dask and --slurm: a sweep runs in one place; name one of them")
    if (dask or slurm) and confinement.mode() == "require":
        raise InputError("--confine=require: workers elsewhere cannot be held to it; leave it out")
    display = terminal.sweep_display(quiet)
    plan = read_plan(file, given_settings(settings, None), seeds, trial_timeout)
    place = choose_place(plan, processes, dask, slurm)
    prepared = Sweep.prepare(plan, out or default_folder(plan), display.note)
    if listing:
        typer.echo(listing_text(prepared, place, as_json))
        return
    estimate = prepared.estimate()
    if estimate.done and not resume:
        raise InputError(
            f"--no-resume: {prepared.data.folder} holds {estimate.done} of these trials; name "
            "another folder by --out, or leave --no-resume out to go on"
        )
    display.note(estimate.text(place))
    with prepared.data.held():
        with Pool(place) as pool:
            prepared.run(pool, display, twin)
        summary = prepared.summary(prepared.finish())
    typer.echo(json.dumps(summary) if as_json else plain(summary_text(summary)))
    raise typer.Exit(prepared.exit_code)
