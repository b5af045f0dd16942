"""`kilotwin export`: a run for other tools."""

from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands.options import command_app
from kilotwin.errors import InputError

app = command_app()


@app.command(
    epilog="Examples:\n\n  kilotwin export runs/my-run --csv my-run-csv\n\n"
    "  kilotwin export runs/my-run --mcap my-run.mcap"
)
def export(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.")],
    *,
    csv: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="A new folder, a CSV file per table."),
    ] = None,
    mcap: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A log that Foxglove opens."),
    ] = None,
) -> None:
    """Write a run as other tools read it: CSV, MCAP for Foxglove."""
    if csv is None and mcap is None:
        raise InputError("nothing to write; name --csv FOLDER or --mcap FILE")
    from kilotwin.runs.reader import Run

    run = Run.open(folder)
    if csv is not None:
        from kilotwin.studies.export.csv_tables import write_csv

        typer.echo(write_csv(run, csv))
    if mcap is not None:
        from kilotwin.studies.export.mcap_file import write_mcap

        typer.echo(write_mcap(run, mcap))
