"""`kilotwin check-run`: whether a run folder is whole, and what there is of it if not."""

import json
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands.options import Json, command_app
from kilotwin.runs.check import WHOLE, check

app = command_app()


@app.command(
    "check-run",
    epilog="Examples:\n\n  kilotwin check-run runs/my-run\n\n"
    "  kilotwin check-run runs/my-run --repair",
)
def check_run(
    folder: Annotated[Path, typer.Argument(help="A run folder.")],
    *,
    repair: Annotated[
        bool,
        typer.Option(
            "--repair",
            help="Of a run that was killed: make its Parquet tables of what is whole, cut off a "
            "torn line, close its manifest.",
        ),
    ] = False,
    as_json: Json = False,
) -> None:
    """Say whether a run folder is whole, truncated, spoiled or damaged. 1 if it is not whole."""
    verdict = check(folder, repair=repair)
    typer.echo(json.dumps(verdict.as_dict()) if as_json else verdict.text())
    raise typer.Exit(0 if verdict.state == WHOLE else 1)
