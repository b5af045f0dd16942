"""A page beside a command that runs or records: `--view`."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from kilotwin.experiment.experiment import Experiment
from kilotwin.session.display import Display

if TYPE_CHECKING:
    from kilotwin.session.attached import AttachedViewer


@contextlib.contextmanager
def window(
    view: bool,
    display: Display,
    *,
    port: int,
    no_browser: bool,
    quiet: bool,
    steers: bool,
    note: str = "",
) -> Iterator["AttachedViewer | None"]:
    """The viewer of what runs meanwhile; None unless `view`. What fails takes it along. `note` is
    shown below the address."""
    if not view:
        yield None
        return

    def shown(address: str) -> None:
        # Without the address there is no page.
        show = display.warn if quiet else display.note
        show(f"view: {address}")
        if note:
            show(note)
        if not no_browser:
            attached.open_page(address)

    from kilotwin.session import attached

    viewer = attached.AttachedViewer(shown, port, steers=steers)
    try:
        yield viewer
    finally:
        viewer.close()


class BesideWindow:
    """A display and a viewer of a recording, which is seen from its folder alone."""

    def __init__(self, display: Display, viewer: "AttachedViewer") -> None:
        self.note = display.note
        self.warn = display.warn
        self.progress = display.progress
        self.stop = display.stop
        self._display = display
        self._viewer = viewer

    def start(self, experiment: Experiment, folder: Path) -> None:
        """The recording begins, in this folder."""
        self._display.start(experiment, folder)
        self._viewer.open(folder)


def beside(display: Display, viewer: "AttachedViewer | None") -> Display:
    """The display, which also opens the viewer when the recording begins."""
    return display if viewer is None else BesideWindow(display, viewer)


def stay(viewer: "AttachedViewer | None") -> None:
    """After the end: until the page was closed, or for Ctrl-C."""
    if viewer is not None:
        what = "the page stays until it is closed; Ctrl-C ends the viewer"
        viewer.stay(lambda: typer.echo(what, err=True))
