"""avrdude, one call after the other: what it does is shown, what it says is understood."""

import os
import re
import select
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from kilotwin.errors import DeviceError, InputError, InterruptError, KilotwinError, RunError
from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.table.flash.progress import Progress

# avrdude tries for a minute, with time-outs of 5 s. One that has answered may answer again.
_MOST_TIMEOUTS = 2
_LOOK_EVERY_MS = 500
_READ_BYTES = 256
_BAR_MARKS = 50
_BAR = re.compile(r"^(Reading|Writing|Erasing) \| (#*)")


@dataclass(frozen=True)
class Wiring:
    """The programmer in avrdude's options: -c, -P, and further ones."""

    kind: str
    port: str
    options: tuple[str, ...] = ()

    def command(self, part: str) -> list[str]:
        """avrdude up to the operations."""
        return ["avrdude", "-p", part, "-c", self.kind, "-P", self.port, *self.options]

    def shown(self, part: str) -> str:
        """The same, to type."""
        return shlex.join(self.command(part))


class SignsOfLife:
    """Output of avrdude so far: how far it came, and why it fails."""

    def __init__(self) -> None:
        self.text = ""
        self._line = ""
        self._timeouts = 0
        self.began = False
        """Whether programmer and chip have answered."""
        self.erased = False
        self.verified = False
        """Whether the flash has been read back and is right."""

    @property
    def hopeless(self) -> bool:
        """Whether it can be ended now."""
        return self._timeouts >= (_MOST_TIMEOUTS if self.began else 1)

    def take(self, text: str) -> float | None:
        """More of its output; the share of the current bar, if there is one."""
        self.text += text
        for character in text:
            if character == "\n":
                self._take_line()
                self._line = ""
            else:
                self._line += character
        bar = _BAR.match(self._line)
        return len(bar[2]) / _BAR_MARKS if bar else None

    def _take_line(self) -> None:
        self.began |= "device initialized" in self._line
        self.erased |= "erasing chip" in self._line
        self.verified |= "flash verified" in self._line
        self._timeouts += bool(re.search(r"\btimeout\b|unable to send|unable to rec", self._line))

    def error(self, wiring: Wiring) -> KilotwinError:
        """Why it failed, in a line for people."""
        text = self.text
        if "cannot find programmer id" in text:
            return InputError(
                f"-c {wiring.kind}: avrdude knows no such programmer; type: avrdude -c '?'"
            )
        if re.search(r"cannot open port|unable to open programmer", text):
            return DeviceError(
                f"no programmer {wiring.kind} at {wiring.port}; plug it in, or name another by -c "
                "and -P"
            )
        if re.search("initialization failed|Invalid device signature|not responding", text):
            return DeviceError(
                "the programmer answers, but no chip does; look at the plug and its direction, "
                "switch the robot on, or go slower by -B 20"
            )
        if re.search("verification (error|mismatch)|mismatch", text, re.IGNORECASE):
            return RunError(
                "what was read back is not what was written; look at the plug and the battery",
                detail=self.tail(),
            )
        if not self.began and self._timeouts:
            return DeviceError(
                f"nothing at {wiring.port} answers as a {wiring.kind}; name the port of a "
                "programmer by -P, its kind by -c"
            )
        if self.hopeless or not _is_there(wiring.port):
            return DeviceError(f"the programmer at {wiring.port} is gone")
        return RunError("avrdude failed", detail=self.tail())

    def tail(self) -> str:
        """Its last lines."""
        lines = [line for line in self.text.splitlines() if line.strip()]
        return "\n".join(lines[-8:])


def _is_there(port: str) -> bool:
    return "/" not in port or Path(port).exists()


def program_path() -> str:
    """Where avrdude is; DeviceError with the command that installs it if it is not here."""
    found = shutil.which("avrdude")
    if found is None:
        raise DeviceError("avrdude is not here; type: apt-get install avrdude")
    return found


def run(
    wiring: Wiring,
    part: str,
    operations: Sequence[str],
    progress: Progress,
    signs: SignsOfLife,
    *,
    delicate: bool = False,
) -> None:
    """One session with the chip; `signs` says at any time how far it came.

    Ctrl-C ends it; if it is `delicate`, only a second one, and the first is answered by a word of
    warning. Raises what SignsOfLife.error() finds, or InterruptError.
    """
    command = [program_path(), *wiring.command(part)[1:], *operations]
    asked = 0
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,  # Ctrl-C is for us, who know what it would leave
    ) as process:

        def interrupt(*_: object) -> None:
            nonlocal asked
            asked += 1
            if asked > delicate:
                process.kill()
            else:
                progress.note("the chip is being written; Ctrl-C again leaves it half written")

        with heeding_interrupts(interrupt):
            _follow(process, signs, wiring.port, progress)
    if asked > delicate:
        raise InterruptError("interrupted")
    if process.returncode != 0:
        raise signs.error(wiring)


def _follow(
    process: "subprocess.Popen[bytes]", signs: SignsOfLife, port: str, progress: Progress
) -> None:
    """Reads what it says until it ends; ends it when it is hopeless, or its port is gone."""
    assert process.stderr is not None
    output = process.stderr.fileno()
    poll = select.poll()
    poll.register(output, select.POLLIN)
    while True:
        if poll.poll(_LOOK_EVERY_MS):
            data = os.read(output, _READ_BYTES)
            if not data:
                return
            share = signs.take(data.decode(errors="replace"))
            if share is not None:
                progress.part(share)
        if signs.hopeless or not _is_there(port):
            process.kill()
