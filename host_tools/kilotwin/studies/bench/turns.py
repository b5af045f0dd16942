"""Commands that take turns: one goes on, the others are stopped, so that all have the same machine.

The speed of a shared machine changes by a third from second to second: in turns of a tenth of a
second each has its share of every state.
"""

import contextlib
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence

import psutil

Command = subprocess.Popen[str]

_TURN_S = 0.1
_GOING = (psutil.STATUS_RUNNING, psutil.STATUS_SLEEPING, psutil.STATUS_DISK_SLEEP)


def take_turns(commands: Sequence[Command]) -> Command | None:
    """Lets each go on for a turn, the first one first, until all have ended or one has failed.

    Which failed, that is had another exit code than 0; the others are killed then, as they are by
    an exception. What a command has started is stopped and killed with it.
    """
    try:
        for command in commands:
            _stop(command.pid)
        going = list(commands)
        while going:
            for command in list(going):
                _each(command.pid, psutil.Process.resume)
                with contextlib.suppress(subprocess.TimeoutExpired):
                    if command.wait(None if len(going) == 1 else _TURN_S) != 0:
                        return command
                    going.remove(command)
                    continue
                _stop(command.pid)
        return None
    finally:
        for command in commands:
            if command.poll() is None:
                _stop(command.pid)
                _each(command.pid, psutil.Process.kill)
                command.wait()


def _stop(pid: int) -> None:
    """A process, then its children: it begins no more meanwhile."""
    with contextlib.suppress(psutil.NoSuchProcess):
        process = psutil.Process(pid)
        process.suspend()
        while process.status() in _GOING:  # a process that waits for a core stops when it has one
            time.sleep(0.001)
        for child in process.children():
            _stop(child.pid)


def _each(pid: int, act: Callable[[psutil.Process], None]) -> None:
    """Children first: a process that goes on finds them going on."""
    for process in _family(pid):
        with contextlib.suppress(psutil.NoSuchProcess):
            act(process)


def _family(pid: int) -> Iterator[psutil.Process]:
    with contextlib.suppress(psutil.NoSuchProcess):
        process = psutil.Process(pid)
        yield from reversed(process.children(recursive=True))
        yield process
