"""`kilotwin view`: a run in the browser."""

import os
import sys
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands import lazy
from kilotwin.commands.options import command_app
from kilotwin.errors import InputError

app = command_app()

_MOST_RUNS = 2


@app.command(
    epilog="Examples:\n\n  kilotwin view runs/my-run\n\n  kilotwin view runs/native runs/chip\n\n"
    "  kilotwin view runs/my-run --port 8000 --no-browser"
)
def view(
    folders: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN [RUN]",
            help="A run folder, finished or under way; two are shown side by side.",
        ),
    ],
    *,
    port: Annotated[
        int,
        typer.Option(
            envvar="KILOTWIN_PORT", min=0, max=65535, help="The server's port; 0: a free one."
        ),
    ] = 0,
    browser: Annotated[
        bool,
        typer.Option(
            "--browser/--no-browser",
            envvar="KILOTWIN_BROWSER",
            help="Open the page, if there is a browser.",
        ),
    ] = True,
) -> None:
    """See a run in the browser, at any time of it."""
    if len(folders) > _MOST_RUNS:
        raise InputError(f"{len(folders)} runs are named; name one, or two to compare")
    runs = [lazy.load("runs.reader").Run.open(folder) for folder in folders]
    served = [lazy.load("view.served_run").ServedRun(run) for run in runs]
    viewer = lazy.load("view.server").Viewer(served, port)
    typer.echo(f"{viewer.address}\nCtrl-C ends the viewer.")
    viewer.serve(lambda: _open(viewer.address) if browser else None)


def _open(address: str) -> None:
    """In the user's browser, where there is a display."""
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open(address)
