"""A viewer beside a run, as the run's command has it: a process of its own, which costs the run
nothing but what it is asked for."""

import contextlib
import json
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from kilotwin.runs.interrupts import heeding_interrupts
from kilotwin.view.server import Place, check_page


class AttachedViewer:
    """Listens from the begin, so that its address is known; answers once the run has a folder."""

    def __init__(
        self, shown: Callable[[str], None], port: int = 0, *, steers: bool = False
    ) -> None:
        """`shown` is called with the address when the run has begun. `port` 0: a free one.
        `steers`: whether the page may steer the run.
        InputError if it is taken; RunError without the built page."""
        check_page()
        self._place = Place.at(port)
        self.address = self._place.address
        """What to open in a browser."""
        self._shown = shown
        self._steers = steers
        self._process: subprocess.Popen[bytes] | None = None
        self._ours: socket.socket | None = None
        self._theirs: socket.socket | None = None

    @property
    def run_end(self) -> int:
        """The descriptor that the run's process inherits, or has; made when first asked for."""
        if self._theirs is None:
            self._ours, self._theirs = socket.socketpair()
        return self._theirs.fileno()

    def handed_over(self) -> None:
        """Another process has it: closes ours, so that the viewer learns when that ends."""
        if self._theirs is not None:
            self._theirs.close()

    def open(self, folder: Path) -> None:
        """Starts the process, and says where the page is."""
        listener = self._place.socket.fileno()
        link = -1 if self._ours is None else self._ours.fileno()
        # A process group of its own: Ctrl-C is for the run.
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "kilotwin.view.beside"],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            process_group=0,
            pass_fds=[descriptor for descriptor in (listener, link) if descriptor >= 0],
        )
        # Not as arguments, which every user of this computer can read.
        asked = {
            "folder": str(folder.absolute()),
            "token": self._place.token,
            "listener": listener,
            "link": link,
            "steers": self._steers,
        }
        self._tell(json.dumps(asked))
        self._place.socket.close()
        if self._ours is not None:
            self._ours.close()
        self._shown(self.address)

    def stay(self, waits: Callable[[], None]) -> None:
        """The run is over: waits until its page was closed, or for Ctrl-C. `waits` is called once
        it does."""
        if self._process is None:
            return
        with heeding_interrupts(lambda *_: self._hang_up()):
            self._tell("over")
            waits()
            self._process.wait()

    def _hang_up(self) -> None:
        if self._process is not None and self._process.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                self._process.stdin.close()

    def close(self) -> None:
        """Ends the viewer; pages keep what they have."""
        if self._process is None:
            self._place.socket.close()
            return
        self._hang_up()
        try:
            self._process.wait(5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process = None

    def _tell(self, line: str) -> None:
        if self._process is not None and self._process.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                self._process.stdin.write(line.encode() + b"\n")
                self._process.stdin.flush()
