"""One program here and on an emulated ATmega328P, side by side: in a process of its own, since the
program may do anything, which is confined (docs/security.md).
"""

import contextlib
import os
import subprocess
import sys
import tempfile
from typing import Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from kilotwin.errors import InputError, RunError
from kilotwin.files import memory_group
from kilotwin.files.plain_text import quoted

_MOST_ANSWER_BYTES, _MOST_WORDS_BYTES = 1 << 26, 1 << 20


class _Message(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PairedRun(_Message):
    """Order for the process: the program in its two forms, and how long it runs.

    `follow`: byte addresses of functions to watch on the chip, `sums` of instructions that end a
    sum, with the carry that is told. With `follow`, the run ends when stack and data meet. `heard`:
    messages in place of those by the seed, with the tick since RUN, in hex, and the distance in mm.
    With `to_difference`, it ends at the first difference. The stack is checked every `look_ticks`:
    what runs on behind a spoilt one means nothing.
    """

    name: str
    guest: str
    elf: str
    seed: int
    uid: int
    slack_s: float
    waits: bool
    follow: list[int] | None
    sums: list[tuple[int, bool]] = []
    heard: list[tuple[int, str, int]] = []
    to_difference: bool = False
    ticks: int
    look_ticks: int = 4


class Difference(_Message):
    """The first decision that one of them does not share."""

    tick: int
    kind: Literal["led", "motors", "message"]
    text: str


class Watched(_Message):
    """The chip's stack, and its calls by address: number, cycles of the longest, its tick; where
    they came from, with the first tick; and sums that carried, with the first tick."""

    stack_bytes: int
    deepest_at: int
    room_bytes: int
    ticks_lost: int
    calls: dict[int, tuple[int, int, int]]
    callers: dict[int, dict[int, int]]
    sums: dict[int, int]


class Measured(_Message):
    """Answer of the process: how far it came, and what was seen. `error`: it could not begin.

    Of the chip: frames sent, of these with a wrong checksum, seconds that motors only hummed.
    """

    error: str = ""
    tick: int = 0
    received: int = 0
    compared: int = 0
    chip_sent: int = 0
    chip_sent_badly: int = 0
    hummed_s: float = 0
    worst_lag_s: float = 0
    difference: Difference | None = None
    avr_failure: str = ""
    native_failure: str = ""
    native_prints: list[tuple[int, str]] = []
    watched: Watched | None = None


def run(wanted: PairedRun, timeout_s: float | None = None) -> Measured:
    """Runs it; what it takes on a second core, and ends with this process.

    InputError if the program does not come to kilo_init(); RunError if it ends its process, or
    takes longer than `timeout_s`.
    """
    command = [sys.executable, "-P", "-m", "kilotwin.programs.port.paired_worker", str(os.getpid())]
    # Its output goes to files, since a program may print more than memory holds.
    with (
        tempfile.TemporaryFile() as answers,
        tempfile.TemporaryFile() as said,
        subprocess.Popen(command, stdin=subprocess.PIPE, stdout=answers, stderr=said) as process,
    ):
        try:
            process.communicate(wanted.model_dump_json().encode(), timeout_s)
        except subprocess.TimeoutExpired:
            raise RunError(f"{wanted.name}: took longer than {timeout_s:g} s") from None
        finally:
            process.kill()
            process.wait()
            memory_group.remove(process.pid)
        answers.seek(0)
        said.seek(0)
        answer, words = answers.read(_MOST_ANSWER_BYTES), said.read(_MOST_WORDS_BYTES)
    measured = None
    with contextlib.suppress(ValidationError):
        measured = Measured.model_validate_json(answer)
    if measured is None:
        what = f"{wanted.name}: the program ended its process (code {process.returncode})"
        raise RunError(what, detail=quoted(words.decode(errors="replace").strip()))
    if measured.error:
        raise InputError(f"{wanted.name}: {measured.error}")
    return measured
