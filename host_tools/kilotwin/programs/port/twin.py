"""Twins: a program that runs natively is once held against its ATmega328P, for some seconds of one
robot, which gets the messages that robots of the run got.

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
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

from kilotwin.errors import InputError, RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.programs import Program
from kilotwin.files.drafts import draft_of
from kilotwin.programs.cache import Notify, cache_folder
from kilotwin.programs.image.tools import avr_gcc
from kilotwin.programs.native.guest import Guest

TWIN_S = 10.0
"""So long a twin runs."""

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


@dataclass(frozen=True)
class Native:
    """A program that runs natively, and the robots of a run that are listened to for it."""

    program: Program
    guest: Guest
    robots: tuple[int, ...] = ()


@dataclass(frozen=True)
class Ear:
    """Messages that one robot of a run got: tick since RUN, nine bytes and the type in hex, mm."""

    uid: int
    heard: tuple[tuple[int, str, int], ...]


class Twins:
    """Twins of an experiment's native programs. Made, they run beside it with messages drawn by
    chance, or are through already if all must agree. With `listens` they wait for begin()."""

    def __init__(
        self, native: Iterable[Native], mode: Mode, notify: Notify, *, listens: bool = False
    ) -> None:
        """RunError if they must agree and one does not."""
        self._notify = notify
        self._verdicts: list[TwinVerdict] = []
        pairs = {one.guest.key: one for one in native}
        listens = listens and mode != "require"
        self._beside = tuple(sorted(pairs)) if listens else ()
        # Those that are known take no thread, beside which the run could not be forked.
        self._pairs = [] if mode == "off" else [p for p in pairs.values() if not self._knows(p)]
        # Nothing is lost with it, and its process ends with it.
        self._thread: threading.Thread | None = None
        if self._pairs and not listens:
            self.begin({})
        if mode == "require":
            self._join()
            self._check()

    @property
    def robots(self) -> tuple[int, ...]:
        """Robots whose messages begin() wants."""
        waits = self._beside and self._thread is None
        return tuple(robot for pair in self._pairs for robot in pair.robots) if waits else ()

    def begin(self, ears: Mapping[int, Ear]) -> None:
        """They begin, with what robots got; those that got nothing with messages by chance."""
        if self._thread is None and self._pairs:
            self._thread = threading.Thread(target=self._hold_all, args=(ears,), daemon=True)
            self._thread.start()

    def verdicts(self) -> Sequence[TwinVerdict]:
        """When they are through; none if they are switched off, or did not begin."""
        self._join()
        return self._verdicts

    def _join(self) -> None:
        if self._thread is not None:
            self._thread.join()

    def _knows(self, pair: Native) -> bool:
        verdict = _known(pair, self._beside)
        if verdict is None:
            return False
        self._add(verdict)
        return True

    def _hold_all(self, ears: Mapping[int, Ear]) -> None:
        for pair in self._pairs:
            its = [ears[robot] for robot in pair.robots if robot in ears and ears[robot].heard]
            self._add(_found(pair, its, self._beside))

    def _add(self, verdict: TwinVerdict) -> None:
        self._verdicts.append(verdict)
        if verdict.agrees is not True or not verdict.known:
            self._notify(verdict.line())

    def _check(self) -> None:
        for verdict in self._verdicts:
            if not verdict.agrees:
                raise RunError(f"--require-twin: {verdict.line()}")


def native_kilobots(experiment: Experiment, guests: Iterable[Guest]) -> Iterator[Native]:
    """Programs that run natively where Kilobots have them, of what its groups were built to. The
    first and the last robot of each are listened to: their parts may differ by their uids."""
    first = 0
    for group, guest in zip(experiment.groups, guests, strict=False):
        if group.tier == "native" and experiment.keys.swarm.profile == "kilobot":
            last = first + group.count - 1
            yield Native(group.program, guest, tuple(sorted({first, last})))
        first += group.count


def differing_ear(program: Program) -> Ear | None:
    """The messages with which a robot was seen to decide otherwise; None if there are none."""
    file = _ear_at(program)
    if not file.exists():
        return None
    kept = json.loads(file.read_text())
    return Ear(kept["uid"], tuple((tick, message, mm) for tick, message, mm in kept["heard"]))


def _known(pair: Native, beside: Sequence[str]) -> TwinVerdict | None:
    """The verdict that needs no twin to run: a kept verdict, or that no avr-gcc is here."""
    try:
        file = _kept_at(pair.guest, avr_gcc(), beside)
    except RunError as error:
        return TwinVerdict(pair.program.written, None, f"{error}")
    if not file.exists():
        return None
    kept = TwinVerdict(**json.loads(file.read_text()))
    return replace(kept, program=pair.program.written, known=True)


def _found(pair: Native, ears: Sequence[Ear], beside: Sequence[str]) -> TwinVerdict:
    """By a twin; kept, if there could be one."""
    verdict = None
    listened: Sequence[Ear | None] = [*ears] or [None]
    for ear in listened:
        verdict = _judged(pair, ear)
        if ear is not None and verdict.agrees is False:
            _keep(_ear_at(pair.program), asdict(ear))
        if not verdict.agrees:
            break
    assert verdict is not None
    if verdict.agrees is not None:
        _keep(_kept_at(pair.guest, avr_gcc(), beside), asdict(verdict))
    return verdict


def _keep(file: Path, what: dict[str, Any]) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    with draft_of(file, sync=False) as draft:
        draft.write_text(json.dumps(what))


def _judged(pair: Native, ear: Ear | None) -> TwinVerdict:
    command = [sys.executable, "-P", "-m", "kilotwin.programs.port.twin_judge", str(os.getpid())]
    order = pickle.dumps((pair.program, pair.guest, ear))
    done = subprocess.run(command, input=order, capture_output=True, check=False)
    if done.returncode != 0:
        words = done.stderr.decode(errors="replace").strip().splitlines()
        return TwinVerdict(pair.program.written, None, words[-1] if words else "its process ended")
    return TwinVerdict(**json.loads(done.stdout))


def _ear_at(program: Program) -> Path:
    words = [*program.defines, *(source.read_text(errors="replace") for source in program.sources)]
    return cache_folder() / f"{_digest(words)}-ear" / "ear.json"


def _digest(words: Sequence[str]) -> str:
    return hashlib.sha256("\0".join(words).encode()).hexdigest()[:32]


def _kept_at(guest: Guest, compiler: str, beside: Sequence[str]) -> Path:
    """`beside`: keys of all native programs of a run whose messages the twin gets."""
    words = [guest.key, *beside]
    engine = importlib.util.find_spec("kilotwin._emulator")
    for file in (str(engine and engine.origin), compiler):
        status = Path(file).stat()
        words += [str(status.st_size), str(status.st_mtime_ns)]
    return cache_folder() / f"{_digest(words)}-twin" / "verdict.json"
