"""`kilotwin view`: a run in the browser."""

from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands.options import NoBrowser, command_app
from kilotwin.errors import InputError

app = command_app()

_MOST_RUNS = 2
_EXPORTED_MB = 10.0


@app.command(
    epilog="Examples:\n\n  kilotwin view runs/my-run\n\n  kilotwin view runs/native runs/chip\n\n"
    "  kilotwin view runs/my-run --port 8000 --no-browser\n\n"
    "  kilotwin view runs/my-run --export my-run.html --size 5\n\n"
    "  kilotwin view my.toml --can socketcan:can0"
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
        typer.Option(min=0, max=65535, help="The server's port; 0: a free one."),
    ] = 0,
    no_browser: NoBrowser = False,
    buses: Annotated[
        list[str] | None,
        typer.Option(
            "--can",
            metavar="IFACE:CHANNEL",
            envvar="KILOTWIN_VIEW_CAN",
            help="Of an experiment's file in place of a run folder: listen to its Kilogrid, which "
            "another host runs, on this bus; nothing is sent. Repeatable.",
        ),
    ] = None,
    export: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.html",
            help="Serve nothing: write the page with the run in it into one file, to mail.",
        ),
    ] = None,
    size: Annotated[
        float | None,
        typer.Option(
            metavar="MB",
            min=1,
            max=1000,
            envvar="KILOTWIN_EXPORT_SIZE",
            help="--export: 10^6 bytes that the file may have, 10 if left out; samples are thinned "
            "until it does.",
        ),
    ] = None,
) -> None:
    """See a run in the browser, at any time of it."""
    if len(folders) > _MOST_RUNS:
        raise InputError(f"{len(folders)} runs are named; name one, or two to compare")
    if size is not None and export is None:
        raise InputError(f"--size {size:g}: of an exported page; add --export FILE.html")
    if buses:
        if len(folders) > 1 or export is not None:
            raise InputError("--can: name the one experiment of that Kilogrid, and no --export")
        from kilotwin.commands.overhear import overhear

        overhear(folders[0], buses, port, no_browser=no_browser)
        return
    from kilotwin.runs.reader import Run

    runs = [Run.open(folder) for folder in folders]
    if export is not None:
        from kilotwin.view.exported_page import write_page

        typer.echo("\n".join(write_page(runs, export, _EXPORTED_MB if size is None else size)))
        return
    from kilotwin.view.served_run import ServedRun

    served = [ServedRun(run) for run in runs]
    from kilotwin.session import attached
    from kilotwin.view import server

    viewer = server.Viewer(served, attached.Place.at(port))
    typer.echo(f"{viewer.address}\nCtrl-C ends the viewer.")
    viewer.serve(lambda: None if no_browser else attached.open_page(viewer.address))
