"""Processes that have a port open: two programs on one serial line spoil each other's bytes."""

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from kilotwin.errors import DeviceError, cause_of

_PROCESSES = Path("/proc")


def holders(port: str) -> list[tuple[int, str]]:
    """Number and name of the other processes that have `port` open, as far as they may be seen.

    Processes of other users are seen by root only.
    """
    device = Path(port).stat().st_rdev
    found = []
    for process in sorted(_PROCESSES.glob("[0-9]*"), key=lambda path: int(path.name)):
        if int(process.name) != os.getpid() and _has_open(process, device):
            with contextlib.suppress(OSError):
                found.append((int(process.name), (process / "comm").read_text().strip()))
    return found


def name_holder(port: str) -> str | None:
    """Another process that has `port` open, for people: "cat (process 12)"; None if none does."""
    with contextlib.suppress(OSError):
        for number, name in holders(port):
            return f"{name} (process {number})"
    return None


def _has_open(process: Path, device: int) -> bool:
    with contextlib.suppress(OSError):
        for file in (process / "fd").iterdir():
            with contextlib.suppress(OSError):
                if file.stat().st_rdev == device:
                    return True
    return False


@contextlib.contextmanager
def reserved(port: str) -> Iterator[None]:
    """Within, no other kilotwin can have the port. Names that are no file (usb) are let through.

    DeviceError, in a line that says what to do, if it is not there, no port, or taken.
    """
    if "/" not in port:
        yield
        return
    try:
        file = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except FileNotFoundError:
        from kilotwin.table.ports.list_ports import this_computer_has

        what = f"{port} is not there; plug it in, or name another port: {this_computer_has()}"
        raise DeviceError(what) from None
    except PermissionError:
        raise DeviceError(
            f"{port} may not be opened by you; type: sudo usermod -a -G dialout $USER, then log in "
            "again"
        ) from None
    except OSError as error:
        reason = cause_of(error)
        raise DeviceError(f"{port} cannot be opened: {reason}; name another port") from None
    try:
        if not os.isatty(file):
            raise DeviceError(f"{port} is no serial port; name another port")
        _refuse_if_taken(port, file)
        yield
    finally:
        os.close(file)


def _refuse_if_taken(port: str, file: int) -> None:
    holder = name_holder(port)
    if holder is None:
        with contextlib.suppress(BlockingIOError):
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        holder = "another program"
    raise DeviceError(f"{port} is in use by {holder}; end that first, then type the same again")
