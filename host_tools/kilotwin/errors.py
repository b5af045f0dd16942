"""The one tree of errors that are for people: a line that says the cause, where, and what to do."""

import os
import re


class KilotwinError(Exception):
    """Base of all. `detail` is shown below the line exactly as it is (a compiler's own words)."""

    exit_code = 1

    def __init__(self, message: str, *, detail: str = "") -> None:
        super().__init__(message)
        self.detail = detail


class RunError(KilotwinError):
    """A check or a run failed."""

    exit_code = 1


class TimeoutRunError(RunError):
    """A run took longer than it may."""


class InputError(KilotwinError):
    """Input that cannot be used. Nothing has been written."""

    exit_code = 2


class DeviceError(KilotwinError):
    """Hardware or an interface is not there."""

    exit_code = 3


# Not an error of the run: it went on without these robots, and the report lists them.
EXIT_ROBOTS_FAILED = 4
EXIT_TIMEOUT = 124  # as timeout(1) has it: runs of a scenario took longer than they may
EXIT_INTERRUPTED = 130


class InterruptError(KilotwinError):
    """The user wanted it to end before it could give a result."""

    exit_code = EXIT_INTERRUPTED


def cause_of(error: OSError) -> str:
    """The system's words for it: `no space left on device`. Arrow's errors have no errno."""
    number = error.errno
    if number is None and (found := re.search(r"\[errno (\d+)\]", str(error))):
        number = int(found[1])
    return (os.strerror(number) if number else error.strerror or str(error)).lower()
