"""A page beside a command that runs or records: `--view`."""

import contextlib
import os
import sys
import webbrowser
from collections.abc import Iterator
from typing import TYPE_CHECKING

import typer

from kilotwin.commands import lazy
from kilotwin.runs.display import Display

if TYPE_CHECKING:
    from kilotwin.view.attached import AttachedViewer


def open_page(address: str) -> None:
    """In the user's browser, where there is a display."""
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open(address)


@contextlib.contextmanager
def window(
    view: bool, display: Display, *, port: int, no_browser: bool, quiet: bool, steers: bool
) -> Iterator["AttachedViewer | None"]:
    """The viewer of what runs meanwhile; None unless `view`. What fails takes it along."""
    if not view:
        yield None
        return

    def shown(address: str) -> None:
        # Without the address there is no page.
        (display.warn if quiet else display.note)(f"view: {address}")
        if not no_browser:
            open_page(address)

    viewer: AttachedViewer = lazy.load("view.attached").AttachedViewer(shown, port, steers=steers)
    try:
        yield viewer
    finally:
        viewer.close()


def stay(viewer: "AttachedViewer | None") -> None:
    """After the end: until the page was closed, or for Ctrl-C."""
    if viewer is not None:
        what = "the page stays until it is closed; Ctrl-C ends the viewer"
        viewer.stay(lambda: typer.echo(what, err=True))
