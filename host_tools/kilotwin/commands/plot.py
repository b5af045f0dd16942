"""`kilotwin plot`: figures of runs and sweeps."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from kilotwin.commands import steps
from kilotwin.commands.options import Quiet, Where, command_app
from kilotwin.errors import InputError

app = command_app()


class Figure(StrEnum):
    """The figures: the first four of a run, curve of a run or a sweep, the others of a sweep."""

    timeline = "timeline"
    map = "map"
    states = "states"
    video = "video"
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
    """Statistics of its trials that a cell of a heat map shows."""

    median = "median"
    iqr = "iqr"
    mean = "mean"


def _option(name: str, metavar: str, text: str) -> Any:
    return typer.Option(f"--{name}", metavar=metavar, envvar=f"KILOTWIN_{name.upper()}", help=text)


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin plot map runs/my-run -o map.png\n\n"
    "  kilotwin plot states runs/my-run -o states.pdf\n\n"
    "  kilotwin plot video runs/my-run -o run.mp4 --speed 100 --trails\n\n"
    "  kilotwin plot video runs/my-run -o far.gif --zoom 0.5\n\n"
    "  kilotwin plot curve runs/my-run --metric spread -o spread.png\n\n"
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
            help="A run folder (timeline, map, states, video, curve) or a sweep's (curve, "
            "and the others).",
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="The picture: .png, .svg or .pdf; of video .mp4, .webm or .gif.",
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
        typer.Option(help="heat: median, if left out."),
    ] = None,
    preset: Annotated[
        str | None,
        _option("preset", "NAME", "Options of a figure of the paper, as paper-median-black."),
    ] = None,
    column: Annotated[
        str | None,
        typer.Option(help="series: which column of series.parquet, over time."),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            min=0.01,
            max=1e6,
            help="video: simulated seconds per second; all in half a minute, if left out.",
        ),
    ] = None,
    from_s: Annotated[
        float | None,
        typer.Option("--from", metavar="S", help="video: its begin."),
    ] = None,
    to_s: Annotated[
        float | None,
        typer.Option("--to", metavar="S", help="video: its end."),
    ] = None,
    width: Annotated[
        int,
        typer.Option(min=160, max=3840, help="video: width of the picture, pixels."),
    ] = 960,
    trails: Annotated[
        bool,
        typer.Option("--trails", help="video: where robots came from."),
    ] = False,
    zoom_m: Annotated[
        float | None,
        typer.Option(
            "--zoom",
            metavar="M",
            help="video: begins with so many metres around the middle, ends with all of the table.",
        ),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Draw a figure of a run or a sweep, or a video of a run."""
    from kilotwin.studies.plot import figures

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
    if figure is Figure.video:
        figures.check_options(figure.value, wanted)
        _write_video(folder, output, (speed, from_s, to_s, width, trails, zoom_m), quiet=quiet)
        return
    for option, given in {"speed": speed, "from": from_s, "to": to_s, "zoom": zoom_m}.items():
        if given is not None:
            raise InputError(f"--{option} {given:g}: for video; {figure.value} is one picture")
    if preset is not None:
        from kilotwin.studies.plot.presets import with_preset

        wanted = with_preset(preset, figure.value, wanted)
    figures.write_figure(figure.value, folder, output, wanted)


def _write_video(
    folder: Path,
    output: Path,
    film: tuple[float | None, float | None, float | None, int, bool, float | None],
    *,
    quiet: bool,
) -> None:
    from kilotwin.runs.reader import Run
    from kilotwin.studies.plot import video

    run = Run.open(folder)
    display = steps.display(quiet)
    display.step(f"drawing {output}")
    try:
        said = video.write_video(run, output, video.Film(*film), display.part)
    finally:
        display.stop()
    typer.echo(said)
