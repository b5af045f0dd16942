"""`kilotwin plot`: figures of runs and sweeps."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from kilotwin.commands import lazy
from kilotwin.commands.options import Where, command_app

app = command_app()


class Figure(StrEnum):
    """The figures: the first three of a run, the others of a sweep."""

    timeline = "timeline"
    map = "map"
    states = "states"
    curve = "curve"
    effect = "effect"
    heat = "heat"
    ecdf = "ecdf"
    series = "series"
    median = "median"
    iqr = "iqr"
    symmetry = "symmetry"
    error = "error"


class Statistic(StrEnum):
    """What a cell of a heat map shows of its trials."""

    median = "median"
    iqr = "iqr"
    mean = "mean"


def _option(name: str, metavar: str, text: str) -> Any:
    return typer.Option(f"--{name}", metavar=metavar, envvar=f"KILOTWIN_{name.upper()}", help=text)


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin plot map runs/my-run -o map.png\n\n"
    "  kilotwin plot states runs/my-run -o states.pdf\n\n"
    "  kilotwin plot curve runs/my-sweep --metric hops --by swarm.size -o hops.png\n\n"
    "  kilotwin plot effect runs/my-sweep --x swarm.size --y hops -o sizes.svg\n\n"
    "  kilotwin plot heat my-sweep --x swarm.size --y medium.loss --metric hops -o heat.png\n\n"
    "  kilotwin plot ecdf runs/my-sweep --metric hops --by swarm.size -o ecdf.png\n\n"
    "  kilotwin plot heat runs/sweep-paper-grid --preset paper-median-black -o black.pdf\n\n"
    "  kilotwin plot median runs/sweep-paper-grid -o median.pdf\n\n"
    "  kilotwin plot symmetry runs/my-sweep --where controller.beta=1.5 -o symmetry.pdf"
)
def plot(
    figure: Annotated[Figure, typer.Argument(help="Which figure.")],
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="RUN|SWEEP",
            help="A run folder (timeline, map, states) or a sweep's (the others).",
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", envvar="KILOTWIN_OUTPUT", help="The picture: .png, .svg or .pdf."
        ),
    ],
    *,
    where: Where = None,
    metric: Annotated[
        str | None, _option("metric", "NAME", "curve, heat, ecdf: a metric, or a column.")
    ] = None,
    x: Annotated[str | None, _option("x", "KEY", "effect, heat: a key that was varied.")] = None,
    y: Annotated[str | None, _option("y", "NAME", "effect: a metric. heat: another key.")] = None,
    by: Annotated[
        str | None, _option("by", "KEY", "curve, ecdf: a line for each value of this key.")
    ] = None,
    hue: Annotated[
        str | None, _option("hue", "KEY", "effect: a line for each value of this key.")
    ] = None,
    panels: Annotated[
        str | None, _option("panels", "KEY", "heat: a map for each value of this key.")
    ] = None,
    statistic: Annotated[
        Statistic | None,
        typer.Option(envvar="KILOTWIN_STATISTIC", help="heat: median, if left out."),
    ] = None,
    preset: Annotated[
        str | None,
        _option("preset", "NAME", "Options of a figure of the paper, as paper-median-black."),
    ] = None,
    column: Annotated[
        str | None,
        typer.Option(
            envvar="KILOTWIN_COLUMN", help="series: which column of series.parquet, over time."
        ),
    ] = None,
) -> None:
    """Draw a figure of a run or a sweep."""
    figures = lazy.load("plot.figures")
    wanted = figures.Wanted(
        tuple(where or ()),
        column,
        metric,
        x,
        y,
        by,
        hue,
        panels,
        None if statistic is None else statistic.value,
    )
    if preset is not None:
        wanted = lazy.load("paper.presets").with_preset(preset, figure.value, wanted)
    figures.write_figure(figure.value, folder, output, wanted)
