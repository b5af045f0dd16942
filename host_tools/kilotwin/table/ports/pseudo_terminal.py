"""A serial port that another program may open, with us behind it: a pseudo terminal."""

import contextlib
import os
import select
import time
import tty
from pathlib import Path

from kilotwin.errors import InputError, cause_of

_READ_BYTES = 4096


class PseudoTerminal:
    """`port` is what other programs open, e.g. /dev/pts/3. It goes with close().

    Bytes pass as they are, at any speed that the other program sets.
    """

    def __init__(self, link: Path | None = None, option: str = "--link") -> None:
        """`link`, if given, becomes a symbolic link to the port; InputError if it cannot.

        `option` is where the user names it.
        """
        self._ours, theirs = os.openpty()
        tty.setraw(theirs)
        self.port = os.ttyname(theirs)
        # Kept open by us as well it would never be seen to be closed by the other program.
        os.close(theirs)
        os.set_blocking(self._ours, False)
        self._link = link
        if link is not None:
            try:
                _replace_link(link, self.port, option)
            except InputError:
                os.close(self._ours)
                raise

    @property
    def shown(self) -> str:
        """The name for people: the link's, if there is one."""
        return self.port if self._link is None else str(self._link)

    def read(self, timeout_s: float) -> bytes | None:
        """Bytes that come within `timeout_s`, if any; None while no program has the port open."""
        poll = select.poll()
        poll.register(self._ours, select.POLLIN)
        events = poll.poll(timeout_s * 1000)
        if not events:
            return b""
        try:
            return os.read(self._ours, _READ_BYTES)
        except BlockingIOError:
            return b""
        except OSError:  # the other side is closed, which poll() does not wait for
            time.sleep(timeout_s)
            return None

    def write(self, data: bytes) -> None:
        """Sends all of it. What a program that is gone, or reads nothing, does not take is lost."""
        while data:
            poll = select.poll()
            poll.register(self._ours, select.POLLOUT)
            if not poll.poll(1000):
                return
            try:
                data = data[os.write(self._ours, data) :]
            except OSError:
                return

    def close(self) -> None:
        """Unplugs the port: a program that has it open gets an error. Once is enough."""
        if self._ours < 0:
            return
        os.close(self._ours)
        self._ours = -1
        with contextlib.suppress(OSError):  # it was removed already
            if self._link is not None and str(self._link.readlink()) == self.port:
                self._link.unlink()


def remove_dead(link: Path) -> None:
    """Removes a link to a port that is gone: its process ended, or may not remove it itself."""
    with contextlib.suppress(OSError):
        if link.is_symlink() and not link.exists():
            link.unlink()


def _replace_link(link: Path, port: str, option: str) -> None:
    """A link that an earlier one left is replaced, any other file is not."""
    try:
        if link.is_symlink():
            link.unlink()
        link.symlink_to(port)
    except FileExistsError:
        raise InputError(f"{option} {link}: there is a file of that name; name another") from None
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"{option} {link}: {reason}; name another") from None
