"""A file in which the engine notes what it does, and which outlives its process; and the watch that
sees by it when a robot's program does not come back, however it holds its process."""

import contextlib
import os
import struct
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from kilotwin.errors import InputError, RunError, cause_of
from kilotwin.experiment.experiment import Experiment

LOOK_S = 1.0
"""From look to look of a Watch."""

VARIABLE = "KILOTWIN_STUCK_S"
_STUCK_S = 60
# Between two calls of the engine a run may write tables, or wait for a metric's function.
_BETWEEN_CALLS = 10

# BlackBox of emulator/robots/record.h; its shares lie on lines of the cache.
_FIELDS, _SHARE, _LINE_BYTES, _MOST_SHARES = struct.Struct("=QII"), struct.Struct("=II"), 64, 32
_PAGE_BYTES = 4096


@dataclass(frozen=True)
class Seen:
    """A look into it: the robots that ran last, one for each thread, and their ticks; the world's
    steps; whether the engine is in a call."""

    robots: tuple[tuple[int, int], ...]
    steps: int
    at_work: bool


@dataclass(frozen=True)
class BlackBox:
    """The file."""

    path: Path

    @staticmethod
    @contextlib.contextmanager
    def made() -> Iterator["BlackBox"]:
        """A new one, which is removed at the end. RunError if the disk has no room for it."""
        folder = Path(tempfile.gettempdir())
        try:
            handle, name = tempfile.mkstemp(prefix="kilotwin-")
        except OSError as error:
            raise _cannot_write(folder, error) from None
        path = Path(name)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(bytes(_PAGE_BYTES))
        except OSError as error:
            path.unlink()
            raise _cannot_write(folder, error) from None
        try:
            yield BlackBox(path)
        finally:
            path.unlink(missing_ok=True)

    def seen(self) -> Seen:
        """As it is now. A program may have written it: any numbers."""
        with self.path.open("rb") as file:
            content = file.read(_PAGE_BYTES).ljust(_PAGE_BYTES, b"\0")
        steps, at_work, shares = _FIELDS.unpack_from(content)
        robots = (
            _SHARE.unpack_from(content, (1 + share) * _LINE_BYTES)
            for share in range(min(shares, _MOST_SHARES))
        )
        return Seen(tuple(robots), steps, at_work != 0)

    def ran_last(self, experiment: Experiment) -> str:
        """The robot that the engine was executing, by uid: "count robot 3 tick 17"; "" if none. Of
        several threads those that were, "... or ..."."""
        seen = self.seen()
        if not seen.at_work:
            return ""
        return " or ".join(
            f"{experiment.program_of(robot).name} robot {experiment.uid_of(robot)} tick {tick}"
            for robot, tick in seen.robots
            if robot < experiment.size
        )

    def out_of_memory(self, experiment: Experiment) -> str:
        """Why the kernel ended the process that took too much (files/memory_group.py), a clause."""
        last = self.ran_last(experiment)
        ran = f"; last to run was {last}" if last else ""
        return f"its programs took more memory than a run gets (docs/security.md){ran}"


class Watch:
    """Looks whether a process gets on. It counts looks and not the wall's time, so that a computer
    that slept, or a parent that was stopped, is no reason."""

    def __init__(self, box: BlackBox) -> None:
        self._box = box
        self._last: Seen | None = None
        self._same = 0
        self.stuck_s = stuck_s()
        """So long nothing may change while the engine is at work."""

    def heard(self) -> None:
        """The process has said something."""
        self._same = 0

    def is_stuck(self) -> bool:
        """To be called each LOOK_S: whether nothing has changed for too long."""
        now = self._box.seen()
        self._same = self._same + 1 if now == self._last else 0
        self._last = now
        return self._same * LOOK_S >= self.stuck_s * (1 if now.at_work else _BETWEEN_CALLS)

    def what(self, experiment: Experiment) -> str:
        """Why the process was ended, as a clause."""
        last = self._box.ran_last(experiment)
        ran = f"; last to run was {last}" if last else ""
        return f"nothing went on in the engine for {self.stuck_s} s, so that it was ended{ran}"


def _cannot_write(folder: Path, error: OSError) -> RunError:
    return RunError(f"{folder}: cannot write ({cause_of(error)}); make room")


def stuck_s() -> int:
    """By KILOTWIN_STUCK_S, else a minute."""
    written = os.environ.get(VARIABLE, str(_STUCK_S))
    if written.isdecimal() and len(written) < 6 and int(written) > 0:
        return int(written)
    raise InputError(f"{VARIABLE}={written}: must be a whole number of seconds, 1 to 99999")
