"""Twins: a program that runs natively is once held against its ATmega328P, for some seconds of one
robot.

A verdict is kept in the cache, as the compiled program is. It is found by a process of its own
(programs/port/twin_judge.py), so that a run which only looks it up need not load what it takes.
"""

import hashlib
import importlib.util
import json
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

from kilotwin.errors import InputError, RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.programs import Program
from kilotwin.files.drafts import draft_of
from kilotwin.programs.cache import Notify, cache_folder
from kilotwin.programs.image.tools import avr_gcc
from kilotwin.programs.native.guest import Guest

Mode = Literal["auto", "require", "off"]
"""auto: beside the run, which says what came of it; require: before it, and it must agree."""


def chosen(*, require: bool, without: bool) -> Mode:
    """Mode by what was typed; InputError if that contradicts itself."""
    if require and without:
        raise InputError("--require-twin and --no-twin: give one of them")
    return "require" if require else "off" if without else "auto"


@dataclass(frozen=True)
class TwinVerdict:
    """Result for one program. `agrees` None: it could not be held against its ATmega328P.

    `known`: it was so before.
    """

    program: str
    agrees: bool | None
    text: str
    known: bool = False

    def line(self) -> str:
        """For people: "twin agrees: blink.c, 3 decisions in 10 s are as on its ATmega328P"."""
        word = {True: "twin agrees", False: "twin differs", None: "no twin"}[self.agrees]
        return f"{word}: {self.program}, {self.text}"


class Twins:
    """Twins of an experiment's native programs. Made, they run beside it, or are through already if
    all must agree."""

    def __init__(self, native: Iterable[tuple[Program, Guest]], mode: Mode, notify: Notify) -> None:
        """RunError if they must agree and one does not."""
        self._notify = notify
        self._verdicts: list[TwinVerdict] = []
        pairs = {guest.key: (program, guest) for program, guest in native}
        # Those that are known take no thread, beside which the run could not be forked.
        self._pairs = [] if mode == "off" else [p for p in pairs.values() if not self._knows(*p)]
        # Nothing is lost with it, and its process ends with it.
        self._thread = threading.Thread(target=self._hold_all, daemon=True)
        if self._pairs:
            self._thread.start()
        if mode == "require":
            self._join()
            self._check()

    def verdicts(self) -> Sequence[TwinVerdict]:
        """When they are through; none if they are switched off."""
        self._join()
        return self._verdicts

    def _join(self) -> None:
        if self._pairs:
            self._thread.join()

    def _knows(self, program: Program, guest: Guest) -> bool:
        verdict = _known(program, guest)
        if verdict is None:
            return False
        self._add(verdict)
        return True

    def _hold_all(self) -> None:
        for program, guest in self._pairs:
            self._add(_found(program, guest))

    def _add(self, verdict: TwinVerdict) -> None:
        self._verdicts.append(verdict)
        if verdict.agrees is not True or not verdict.known:
            self._notify(verdict.line())

    def _check(self) -> None:
        for verdict in self._verdicts:
            if not verdict.agrees:
                raise RunError(f"--require-twin: {verdict.line()}")


def native_kilobots(
    experiment: Experiment, guests: Iterable[Guest]
) -> Iterator[tuple[Program, Guest]]:
    """Programs that run natively where Kilobots have them, of what its groups were built to."""
    for group, guest in zip(experiment.groups, guests, strict=False):
        if group.tier == "native" and experiment.keys.swarm.profile == "kilobot":
            yield group.program, guest


def _known(program: Program, guest: Guest) -> TwinVerdict | None:
    """The verdict that needs no twin to run: a kept verdict, or that no avr-gcc is here."""
    try:
        file = _kept_at(guest, avr_gcc())
    except RunError as error:
        return TwinVerdict(program.written, None, f"{error}")
    if not file.exists():
        return None
    kept = TwinVerdict(**json.loads(file.read_text()))
    return replace(kept, program=program.written, known=True)


def _found(program: Program, guest: Guest) -> TwinVerdict:
    """By a twin; kept, if there could be one."""
    verdict = _judged(program, guest)
    if verdict.agrees is not None:
        file = _kept_at(guest, avr_gcc())
        file.parent.mkdir(parents=True, exist_ok=True)
        with draft_of(file, sync=False) as draft:
            draft.write_text(json.dumps(asdict(verdict)))
    return verdict


def _judged(program: Program, guest: Guest) -> TwinVerdict:
    command = [sys.executable, "-P", "-m", "kilotwin.programs.port.twin_judge", str(os.getpid())]
    order = pickle.dumps((program, guest))
    done = subprocess.run(command, input=order, capture_output=True, check=False)
    if done.returncode != 0:
        words = done.stderr.decode(errors="replace").strip().splitlines()
        return TwinVerdict(program.written, None, words[-1] if words else "its process was ended")
    return TwinVerdict(**json.loads(done.stdout))


def _kept_at(guest: Guest, compiler: str) -> Path:
    words = [guest.key]
    engine = importlib.util.find_spec("kilotwin._emulator")
    for file in (str(engine and engine.origin), compiler):
        status = Path(file).stat()
        words += [str(status.st_size), str(status.st_mtime_ns)]
    key = hashlib.sha256("\0".join(words).encode()).hexdigest()[:32]
    return cache_folder() / f"{key}-twin" / "verdict.json"
