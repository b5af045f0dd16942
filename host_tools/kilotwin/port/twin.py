"""Twins: a program that runs natively is once held against its ATmega328P, for some seconds of one
robot, so that nobody trusts what the robot would not do.

A verdict is kept in the cache with the compiled programs that it is about.
"""

import hashlib
import json
import threading
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

from kilotwin import _emulator
from kilotwin.build.avr import Image, avr_gcc, build_image
from kilotwin.build.guest import Guest, Notify, cache_folder
from kilotwin.errors import InputError, KilotwinError, RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.programs import Program
from kilotwin.files.drafts import draft_of
from kilotwin.port import paired_run
from kilotwin.port.disassembly import Disassembly
from kilotwin.port.paired_run import Measured, PairedRun
from kilotwin.port.roles import find_roles, own_lines
from kilotwin.port.trial import SLACK_S, UID, waits
from kilotwin.units import ticks

SECONDS = 10.0
_SEED = 1
_TIMEOUT_S = 60.0

Mode = Literal["auto", "require", "off"]
"""auto: beside the run, which says what came of it; require: before it, and it must agree."""


def chosen(*, require: bool, without: bool) -> Mode:
    """Mode by what was typed; InputError if that contradicts itself."""
    if require and without:
        raise InputError("--require-twin and --no-twin: give one of them")
    return "require" if require else "off" if without else "auto"


@dataclass(frozen=True)
class Verdict:
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
        self._pairs = list({guest.key: (program, guest) for program, guest in native}.values())
        self._notify = notify
        self._verdicts: list[Verdict] = []
        # Nothing is lost with it, and its process ends with it.
        self._thread = threading.Thread(target=self._hold_all, daemon=True)
        if mode == "off" or not self._pairs:
            return
        self._thread.start()
        if mode == "require":
            self._thread.join()
            self._check()

    def verdicts(self) -> Sequence[Verdict]:
        """When they are through; none if they are switched off."""
        if self._thread.ident is not None:
            self._thread.join()
        return self._verdicts

    def _hold_all(self) -> None:
        for program, guest in self._pairs:
            verdict = _verdict(program, guest)
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
        native = not (group.on_board or group.translated)
        if native and experiment.keys.swarm.profile == "kilobot":
            yield group.program, guest


def _verdict(program: Program, guest: Guest) -> Verdict:
    name = program.written
    try:
        avr_gcc()
    except RunError as error:
        return Verdict(name, None, f"{error}")
    try:
        image = build_image(program)
    except KilotwinError as error:
        return Verdict(name, False, f"which does not build for the ATmega328P: {error}")
    file = _kept_at(guest, image)
    if file.exists():
        return replace(Verdict(**json.loads(file.read_text())), program=name, known=True)
    try:
        verdict = _judged(name, _measured(program, guest, image))
    except KilotwinError as error:
        return Verdict(name, None, f"{error}")
    file.parent.mkdir(parents=True, exist_ok=True)
    with draft_of(file, sync=False) as draft:
        draft.write_text(json.dumps(asdict(verdict)))
    return verdict


def _measured(program: Program, guest: Guest, image: Image) -> Measured:
    code = Disassembly.of(image)
    wanted = PairedRun(
        name=guest.name,
        guest=str(guest.file),
        elf=str(image.elf),
        seed=_SEED,
        uid=UID,
        slack_s=SLACK_S,
        waits=waits(code, find_roles(own_lines(program))),
        follow=None,
        ticks=ticks(SECONDS),
        look_ticks=ticks(SECONDS),
    )
    return paired_run.run(wanted, _TIMEOUT_S)


def _judged(name: str, measured: Measured) -> Verdict:
    if failure := measured.native_failure or measured.avr_failure:
        where = "here" if measured.native_failure else "on the robot"
        return Verdict(name, False, f"it cannot go on {where}: {failure}")
    if measured.difference is not None:
        first = f"first at tick {measured.difference.tick:,}: {measured.difference.text}"
        why = f'`kilotwin port {name}` says why, cpu = "translated" runs it as the robot does'
        return Verdict(name, False, f"{first}; {why}")
    how_many = f"{measured.compared:,} decisions in {SECONDS:g} s"
    return Verdict(name, True, f"{how_many} are as on its ATmega328P")


def _kept_at(guest: Guest, image: Image) -> Path:
    engine = Path(str(_emulator.__file__)).stat()
    words = [guest.key, image.key, f"{SECONDS}", f"{engine.st_size}", f"{engine.st_mtime_ns}"]
    key = hashlib.sha256("\0".join(words).encode()).hexdigest()[:32]
    return cache_folder() / f"{key}-twin" / "verdict.json"
