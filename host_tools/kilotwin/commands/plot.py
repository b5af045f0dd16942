"""`kilotwin plot`: figures of runs and sweeps."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands import lazy
from kilotwin.commands.options import Where, command_app

app = command_app()


class Figure(StrEnum):
    """The figures: two of a run, the others of a sweep."""

    timeline = "timeline"
    map = "map"
    median = "median"
    iqr = "iqr"
    symmetry = "symmetry"
    error = "error"
    series = "series"


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin plot map runs/my-run -o map.png\n\n"
    "  kilotwin plot timeline runs/my-run -o timeline.pdf\n\n"
    "  kilotwin plot median runs/sweep-paper-grid -o median.pdf\n\n"
    "  kilotwin plot symmetry runs/my-sweep --where controller.beta=1.5 -o symmetry.pdf\n\n"
    "  kilotwin plot series runs/my-sweep --column state_past -o past.png"
)
def plot(
    figure: Annotated[Figure, typer.Argument(help="Which figure.")],
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="RUN|SWEEP",
            help="A run folder (timeline, map) or a sweep's (the others).",
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", envvar="KILOTWIN_OUTPUT", help="The picture: .png, .svg or .pdf."
        ),
    ],
    where: Where = None,
    column: Annotated[
        str | None,
        typer.Option(
            envvar="KILOTWIN_COLUMN", help="series: which column of series.parquet, over time."
        ),
    ] = None,
) -> None:
    """Draw a figure of a run or a sweep."""
    lazy.load("plot.figures").write_figure(figure.value, folder, output, where or [], column)
