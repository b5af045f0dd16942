"""The viewer's process beside a run: `python -m kilotwin.view.beside`.

Its first line on stdin is JSON: `folder`, `token`, whether pages may steer (`steers`), whether a
notebook may have them in a frame (`framed`), and the descriptors `listener` and `link` (-1: none).
A second line says that the run is over; then it ends when the last page was closed. It ends with
its stdin.
"""

import contextlib
import json
import socket
import sys
import threading
import time
from pathlib import Path

from kilotwin.runs.reader import Run
from kilotwin.session.attached import Place
from kilotwin.view.helm import helm_of
from kilotwin.view.run_link import RunLink
from kilotwin.view.served_run import ServedRun
from kilotwin.view.server import Pages, Viewer

# A page that is loaded anew is away for less.
_AWAY_S = 3.0
_LOOK_S = 0.2


def main() -> None:
    """Serves the run until it is over and seen, or the parent has gone."""
    asked = json.loads(sys.stdin.readline())
    place = Place(socket.socket(fileno=asked["listener"]), asked["token"])
    link = None if asked["link"] < 0 else RunLink(socket.socket(fileno=asked["link"]))
    folder = Path(asked["folder"])
    helm = helm_of(folder) if asked["steers"] else None
    served = [ServedRun(Run.open(folder))]
    viewer = Viewer(served, place, link, helm, framed=asked["framed"])
    ended, over = threading.Event(), threading.Event()
    threading.Thread(target=_heed_parent, args=(over, ended), daemon=True).start()
    threading.Thread(target=_end_unseen, args=(over, viewer.pages, ended), daemon=True).start()
    viewer.serve(lambda: None, ended)


def _heed_parent(over: threading.Event, ended: threading.Event) -> None:
    with contextlib.suppress(OSError):
        if sys.stdin.readline():
            over.set()
            sys.stdin.readline()
    ended.set()


def _end_unseen(over: threading.Event, pages: Pages, ended: threading.Event) -> None:
    over.wait()
    while not ended.is_set():
        closed_at = pages.closed_at
        if not pages.open and closed_at is not None and time.monotonic() - closed_at > _AWAY_S:
            ended.set()
        time.sleep(_LOOK_S)


if __name__ == "__main__":
    main()
