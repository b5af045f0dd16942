"""`kilotwin view EXPERIMENT --can`: a Kilogrid that a host elsewhere runs, as it goes."""

import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path

import typer

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.folder import slug
from kilotwin.runs.reader import Run
from kilotwin.session.attached import Place, open_page
from kilotwin.session.overhearing import Overhearing
from kilotwin.table.can.buses import name_all, need_answers
from kilotwin.view.served_run import ServedRun
from kilotwin.view.server import Viewer


def overhear(file: Path, interfaces: Sequence[str], port: int, *, no_browser: bool) -> None:
    """Serves the page until Ctrl-C. What was heard is not kept."""
    experiment = Experiment.load(file)
    grid = experiment.keys.grid
    if grid is None:
        raise InputError(f"{file}: no [grid] to listen to; name an experiment that has one")
    names = name_all(interfaces, grid.buses, (grid.columns, grid.rows))
    need_answers(names, "look at the record's own folder: kilotwin view RUN")
    place = Place.at(port)
    ended = threading.Event()
    with tempfile.TemporaryDirectory(prefix="kilotwin-heard-") as scratch:
        folder = Path(scratch) / slug(experiment.keys.name)
        overhearing = Overhearing(experiment, names, folder)
        listening = threading.Thread(target=overhearing.run, args=(ended,))
        try:
            viewer = Viewer([ServedRun(Run.open(folder))], place, bus=overhearing.state)
            typer.echo(f"{viewer.address}\nIt listens only. Ctrl-C ends the viewer.")
            listening.start()
            viewer.serve(lambda: None if no_browser else open_page(viewer.address))
        finally:
            ended.set()
            if listening.is_alive():
                listening.join()
            overhearing.close()
