"""`kilotwin optimise`: the best values of some keys of an experiment."""

import contextlib
import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from kilotwin.commands import terminal
from kilotwin.commands.options import Json, Quiet, command_app, given_settings
from kilotwin.commands.sweep import (
    AllSettings,
    DaskAddress,
    DataFolder,
    NumberOfProcesses,
    TrialTimeout,
)
from kilotwin.errors import InputError
from kilotwin.files import extras
from kilotwin.studies.pool.places import Place, place_for
from kilotwin.studies.search.points import Laboratory
from kilotwin.studies.search.space import parse_axes, whole_numbers_of

app = command_app()

Over = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KEY=RANGE",
        help="A key to choose, as beta=1..4, size=10..50:10, x=0.001..1,log or kind=a|b; "
        "repeatable.",
    ),
]
Repeats = Annotated[
    int,
    typer.Option(min=1, max=10_000, help="Seeds of each point."),
]
SearchSeed = Annotated[int, typer.Option("--search-seed", help="Of the choices.")]


class Goal(StrEnum):
    """Whether a metric is to be large or small."""

    max = "max"
    min = "min"


class Sampler(StrEnum):
    """How points are proposed."""

    tpe = "tpe"
    cmaes = "cmaes"
    random = "random"


class By(StrEnum):
    """The library that searches."""

    optuna = "optuna"
    irace = "irace"


def laboratory_of(
    file: Path,
    settings: list[str] | None,
    metrics: list[str],
    place: Place,
    *,
    trial_timeout: float | None,
    quiet: bool,
) -> Laboratory:
    """The laboratory of a search by what was typed, not yet opened."""
    given, display = given_settings(settings, None), terminal.sweep_display(quiet)
    return Laboratory(file, given, metrics, Path(), place, display, trial_timeout)


def tell(laboratory: Laboratory, found: Any, as_json: bool) -> None:
    """Writes the report of a search and prints it."""
    from kilotwin.studies.search import report

    text = report.write(laboratory.folder, found)
    typer.echo(json.dumps(report.as_dict(found)) if as_json else f"{text}\n\n{laboratory.folder}")


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin optimise my.toml --over robots.0.count=10..50 --metric hops --goal min\n\n"
    "  kilotwin optimise my.toml --over controller.beta=1..4 --over controller.update_s=1..10 "
    "--metric error --goal min --points 40\n\n"
    "  kilotwin optimise my.toml --over x=1..4 --metric speed --goal max --metric messages "
    "--goal min\n\n"
    "  kilotwin optimise my.toml --with irace --over controller.beta=1..4 --metric error "
    "--goal min --points 100"
)
def optimise(
    file: Annotated[Path, typer.Argument(metavar="EXPERIMENT", help="The experiment.")],
    *,
    over: Over = None,
    metric: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Repeatable."),
    ] = None,
    goal: Annotated[
        list[Goal] | None,
        typer.Option(help="max or min, one for each metric."),
    ] = None,
    by: Annotated[
        By,
        typer.Option(
            "--with",
            help="What searches. irace races points over seeds, with points x repeats trials in "
            "all; it is r-cran-irace of Debian.",
        ),
    ] = By.optuna,
    points: Annotated[int, typer.Option(min=1, max=100_000, help="To try.")] = 40,
    repeats: Repeats = 3,
    batch: Annotated[
        int,
        typer.Option(min=1, max=1000, help="Points that are tried side by side."),
    ] = 4,
    sampler: Annotated[Sampler, typer.Option()] = Sampler.tpe,
    prune: Annotated[
        bool,
        typer.Option("--prune", help="Give up points that are bad at first repeats."),
    ] = False,
    prune_at: Annotated[
        list[float] | None,
        typer.Option(
            metavar="SHARE",
            help="Give up points that are bad after this share of the duration; repeatable.",
        ),
    ] = None,
    confirm: Annotated[
        int,
        typer.Option(
            min=0,
            max=10_000,
            help="Seeds with which the best is held against the experiment as it is.",
        ),
    ] = 10,
    search_seed: SearchSeed = 1,
    processes: NumberOfProcesses = None,
    dask: DaskAddress = None,
    settings: AllSettings = None,
    out: DataFolder = None,
    trial_timeout: TrialTimeout = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Search for the values of keys with which a metric is best. Goes on where it was stopped."""
    extras.require("optuna", "cmaes", "SALib")
    names, goals = metric or [], goal or []
    if not names or len(names) != len(goals):
        raise InputError("--metric, --goal: one goal for each metric, as --metric hops --goal min")
    from kilotwin.studies.search import optimise as found_by

    search = found_by.Search(
        parse_axes(over or [], whole_numbers_of(file)),
        [found_by.Goal(name, one.value) for name, one in zip(names, goals, strict=True)],
        points,
        repeats,
        batch,
        sampler.value,
        search_seed,
        prune,
        confirm,
        tuple(prune_at or ()),
    )
    search.check()
    place = place_for(processes, dask)
    laboratory = laboratory_of(
        file, settings, names, place, trial_timeout=trial_timeout, quiet=quiet
    )
    laboratory.open(out, "irace" if by is By.irace else "optimise")
    with contextlib.closing(laboratory):
        if by is By.irace:
            from kilotwin.studies.search.irace import race

            found = race(search, laboratory, laboratory.display.note)
        else:
            found = found_by.optimise(search, laboratory, laboratory.display.note)
    tell(laboratory, found, as_json)
    raise typer.Exit(0 if found.front else 1)
