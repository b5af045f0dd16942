"""`kilotwin sensitivity`: which keys of an experiment matter for a metric."""

import contextlib
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands.optimise import Over, Repeats, SearchSeed, laboratory_of, tell
from kilotwin.commands.options import Json, Quiet, command_app
from kilotwin.commands.sweep import (
    AllSettings,
    DaskAddress,
    DataFolder,
    NumberOfProcesses,
    TrialTimeout,
)
from kilotwin.files import extras
from kilotwin.studies.pool.places import place_for
from kilotwin.studies.search.space import parse_axes, whole_numbers_of

app = command_app()


class Method(StrEnum):
    """How influence is measured."""

    morris = "morris"
    sobol = "sobol"


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin sensitivity my.toml --over swarm.size=10..50 --over medium.loss=0..0.5 "
    "--metric hops\n\n"
    "  kilotwin sensitivity my.toml --method sobol --samples 64 --over x=1..4 --over y=0.1..1 "
    "--metric hops"
)
def sensitivity(
    file: Annotated[Path, typer.Argument(metavar="EXPERIMENT", help="The experiment.")],
    *,
    metric: Annotated[str, typer.Option(metavar="NAME")],
    over: Over = None,
    method: Annotated[
        Method,
        typer.Option(
            help="morris: few trials, which keys matter; sobol: shares of the variance.",
        ),
    ] = Method.morris,
    samples: Annotated[
        int,
        typer.Option(
            min=2,
            max=100_000,
            help="Trajectories of Morris, base points of Sobol (a power of 2).",
        ),
    ] = 8,
    repeats: Repeats = 3,
    search_seed: SearchSeed = 1,
    processes: NumberOfProcesses = None,
    dask: DaskAddress = None,
    settings: AllSettings = None,
    out: DataFolder = None,
    trial_timeout: TrialTimeout = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say which keys matter for a metric. Goes on where it was stopped."""
    extras.require("optuna", "cmaes", "SALib")
    axes = parse_axes(over or [], whole_numbers_of(file))
    place = place_for(processes, dask)
    laboratory = laboratory_of(
        file, settings, [metric], place, trial_timeout=trial_timeout, quiet=quiet
    )
    laboratory.open(out, "sensitivity")
    from kilotwin.studies.search import sensitivity as module

    with contextlib.closing(laboratory):
        found = module.sensitivity(
            axes,
            metric,
            laboratory,
            method=method.value,
            samples=samples,
            repeats=repeats,
            seed=search_seed,
        )
    tell(laboratory, found, as_json)
