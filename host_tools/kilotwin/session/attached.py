"""A viewer beside a run, as the run's command has it: a process of its own, which costs the run
nothing but what it is asked for."""

import contextlib
import json
import os
import secrets
import socket
import subprocess
import sys
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import kilotwin
from kilotwin.errors import InputError, RunError, cause_of
from kilotwin.files.interrupts import heeding_interrupts

HOST = "127.0.0.1"
PAGE = Path(kilotwin.__file__).parent / "view" / "page"


def open_page(address: str) -> None:
    """In the user's browser, where there is a display."""
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open(address)


def check_page(page: Path = PAGE) -> None:
    """RunError if the page was not built."""
    if not (page / "index.html").is_file():
        raise RunError("the viewer's page is not built; type: make setup")


@dataclass(frozen=True)
class Place:
    """Where a viewer listens; `address` is what to open."""

    socket: socket.socket
    token: str

    @staticmethod
    def at(port: int = 0) -> "Place":
        """`port` 0: a free one. InputError if it is taken."""
        return Place(_listening(port), secrets.token_urlsafe(16))

    @property
    def address(self) -> str:
        """The page's address, with the token."""
        return f"http://{HOST}:{self.socket.getsockname()[1]}/{self.token}/"


def _listening(port: int) -> socket.socket:
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
    except OSError as error:
        listener.close()
        raise InputError(
            f"--port {port}: {cause_of(error)}; name another, or 0 for a free one"
        ) from None
    listener.listen(128)
    return listener


class AttachedViewer:
    """Listens from the begin, so that its address is known; answers once the run has a folder."""

    def __init__(
        self,
        shown: Callable[[str], None],
        port: int = 0,
        *,
        steers: bool = False,
        framed: bool = False,
    ) -> None:
        """`shown` is called with the address when the run has begun. `port` 0: a free one.
        `steers`: whether the page may steer the run; `framed`: a notebook may have it in a frame.
        InputError if it is taken; RunError without the built page."""
        check_page()
        self._place = Place.at(port)
        self.address = self._place.address
        """The address to open in a browser."""
        self._shown = shown
        self._may = {"steers": steers, "framed": framed}
        self._process: subprocess.Popen[bytes] | None = None
        self._pair: tuple[socket.socket, socket.socket] | None = None  # the viewer's, the run's

    @property
    def run_end(self) -> int:
        """The descriptor that the run's process inherits, or has; made when first asked for."""
        self._pair = self._pair or socket.socketpair()
        return self._pair[1].fileno()

    def handed_over(self) -> None:
        """Another process has the run's end: closes it here, so that the viewer learns when that
        process ends."""
        if self._pair is not None:
            self._pair[1].close()

    def open(self, folder: Path) -> None:
        """Starts the process, and says where the page is."""
        listener = self._place.socket.fileno()
        link = -1 if self._pair is None else self._pair[0].fileno()
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
            **self._may,
        }
        self._tell(json.dumps(asked))
        self._place.socket.close()
        if self._pair is not None:
            self._pair[0].close()
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
        for end in self._pair or ():
            end.close()
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
