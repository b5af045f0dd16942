"""`kilotwin new`: a repository for a lab's programs, with tests and CI."""

import json
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands.options import Json, command_app
from kilotwin.files import templates

app = command_app()


@app.command(epilog="Examples:\n\n  kilotwin new my-swarm\n\n  kilotwin new my-table --grid")
def new(
    folder: Annotated[Path, typer.Argument(metavar="NAME", help="The folder to make.")],
    *,
    grid: Annotated[
        bool, typer.Option("--grid", envvar="KILOTWIN_GRID", help="Robots on a Kilogrid.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Make a repository for a lab: program, experiment, scenario, tests, and files for CI."""
    written = templates.write("grid" if grid else "robots", folder)
    if as_json:
        typer.echo(json.dumps({"folder": str(folder), "files": [str(file) for file in written]}))
        return
    for file in written:
        typer.echo(f"  {folder / file}")
    typer.echo(f"now type: cd {folder} && git init && pytest")
