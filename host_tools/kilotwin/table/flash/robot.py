"""One robot flashed by a programmer: read, judge, keep, write, read back.

Whatever ends it, the last line says what the chip holds and what to type next.
"""

import shlex
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kilotwin.errors import KilotwinError, RunError
from kilotwin.files import image_record
from kilotwin.files.flash_map import FLASH_BYTES, Segments
from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.files.memories import write_memories
from kilotwin.table.flash import avrdude, eeprom_files
from kilotwin.table.flash.avrdude import SignsOfLife, Wiring
from kilotwin.table.flash.chip import AVRDUDE_PARTS, EEPROM_BYTES, Chip
from kilotwin.table.flash.image import has_loader, pages_of
from kilotwin.table.flash.loader import Loader, loader_in
from kilotwin.table.flash.progress import Progress
from kilotwin.units import counted

_ANY_PART = "m328p"
_MEMORIES = ("signature", "lfuse", "hfuse", "efuse", "lock", "eeprom")


@dataclass(frozen=True)
class Job:
    """A flash that is wanted: the robot's programmer, and what to write."""

    wiring: Wiring
    application: Segments
    loader: Loader
    eeprom: Path | None = None
    """In place of what the chip has."""
    keep: Path = Path("eeprom")
    again: Sequence[str] = ()
    """The command that was typed."""


@dataclass
class Outcome:
    """How far it came."""

    chip: Chip
    pages: int
    loader: str
    warnings: list[str] = field(default_factory=list)
    obstacle: str | None = None
    eeprom_file: Path | None = None
    eeprom_written: bool = False
    written: bool = False

    def as_dict(self) -> dict[str, Any]:
        """The --json object."""
        return {
            **self.chip.as_dict(),
            "warnings": self.warnings,
            "obstacle": self.obstacle,
            "pages": self.pages,
            "loader": self.loader,
            "eeprom_file": str(self.eeprom_file) if self.eeprom_file else None,
            "eeprom_written": self.eeprom_written,
            "written": self.written,
            "verified": self.written,
        }

    def text(self) -> str:
        """The last lines for people."""
        if not self.written:
            pages = counted(self.pages, "page")
            return f"would write {pages}, boot loader: {self.loader}; this was a dry run"
        eeprom = "was written" if self.eeprom_written else "is as it was"
        kept = f", and is kept in {self.eeprom_file}" if self.eeprom_file else ""
        return (
            f"flashed and verified: {counted(self.pages, 'page')}, boot loader: {self.loader}\n"
            f"the EEPROM {eeprom}{kept}"
        )


def check_answers(wiring: Wiring, progress: Progress) -> None:
    """DeviceError if the programmer or a chip does not answer; reads and writes nothing."""
    progress.step("looking for the programmer")
    try:
        avrdude.run(wiring, _ANY_PART, ["-F"], progress, SignsOfLife())
    except KilotwinError as error:
        raise _with(error, "nothing was written") from None


class RobotFlasher:
    """Steps of one flash: look(), then write()."""

    def __init__(self, job: Job, progress: Progress) -> None:
        self._job, self._progress = job, progress
        self._image: Segments = {}
        self._part = _ANY_PART

    def look(self) -> Outcome:
        """Reads the chip and says whether it may be written. Nothing is written yet.

        DeviceError if programmer or chip do not answer.
        """
        names = (*_MEMORIES, "flash") if self._job.loader.from_chip else _MEMORIES
        self._progress.step("reading the chip")
        try:
            memories = self._read(names)
        except KilotwinError as error:
            raise _with(error, "nothing was written") from None
        chip = Chip(
            signature=memories["signature"],
            low=memories["lfuse"][0],
            high=memories["hfuse"][0],
            extended=memories["efuse"][0],
            lock=memories["lock"][0],
            eeprom=memories["eeprom"].ljust(EEPROM_BYTES, b"\xff"),
        )
        self._part = AVRDUDE_PARTS[chip.part] if chip.part else _ANY_PART
        return self._plan(chip, memories.get("flash", b"").ljust(FLASH_BYTES, b"\xff"))

    def _plan(self, chip: Chip, flash: bytes) -> Outcome:
        job = self._job
        boot, name, ours = job.loader.segments, job.loader.name, job.loader.ours
        if job.loader.from_chip:
            boot, ours = loader_in(flash), image_record.is_recorded(flash)
            name = "the one in the chip" if boot else "none"
        application = job.application
        if boot and ours:
            application = image_record.recorded(application)
        self._image = {**application, **boot}
        outcome = Outcome(chip, pages_of(job.application), name, chip.warnings())
        with_loader = has_loader(self._image)
        outcome.obstacle = chip.obstacle(job.wiring.shown(self._part), loader=with_loader)
        if not with_loader:
            outcome.warnings.append("without a boot loader this robot is flashed by wire only")
        if not chip.calibrated and job.eeprom is None and chip.readable:
            outcome.warnings.append(
                "the EEPROM is erased; if an earlier flash was broken off, give the file that it "
                "named by --eeprom"
            )
        return outcome

    def check(self, outcome: Outcome) -> None:
        """RunError if the chip may not be written."""
        if outcome.obstacle is not None:
            raise RunError(f"nothing was written: {outcome.obstacle}")

    def write(self, outcome: Outcome) -> None:
        """Keeps the EEPROM, writes flash and what the EEPROM has lost, reads all back."""
        self.check(outcome)
        chip = outcome.chip
        wanted = chip.eeprom
        if chip.calibrated:
            outcome.eeprom_file = eeprom_files.keep(self._job.keep, wanted, chip.uid)
        if self._job.eeprom is not None:
            wanted = eeprom_files.read(self._job.eeprom, wanted)
        # Ctrl-C between two sessions would leave the EEPROM erased.
        unheeded = heeding_interrupts(lambda *_: self._progress.note("it is nearly done"))
        with tempfile.TemporaryDirectory(prefix="kilotwin-") as folder, unheeded:
            after = self._write_flash(outcome, Path(folder))
            if after != wanted:
                self._write_eeprom(outcome, wanted, Path(folder))
        outcome.written = True

    def _write_flash(self, outcome: Outcome, folder: Path) -> bytes:
        """Erases the chip and writes it; returns what the EEPROM then holds."""
        image, eeprom = folder / "image.hex", folder / "eeprom"
        write_memories(image, self._image)
        self._progress.step(
            f"writing {counted(outcome.pages, 'page')} and the boot loader, and reading back"
        )
        signs = SignsOfLife()
        operations = ["-U", f"flash:w:{image}:i", "-U", f"eeprom:r:{eeprom}:r"]
        try:
            self._run(operations, signs, delicate=True)
        except KilotwinError as error:
            raise _with(error, self._state(outcome, signs)) from None
        return eeprom.read_bytes().ljust(EEPROM_BYTES, b"\xff")

    def _write_eeprom(self, outcome: Outcome, wanted: bytes, folder: Path) -> None:
        file = folder / "eeprom.hex"
        write_memories(file, {0: wanted})
        self._progress.step("writing the EEPROM, and reading it back")
        signs = SignsOfLife()
        signs.erased = signs.verified = True
        try:
            self._run(["-U", f"eeprom:w:{file}:i"], signs, delicate=True)
        except KilotwinError as error:
            raise _with(error, self._state(outcome, signs)) from None
        outcome.eeprom_written = True

    def _state(self, outcome: Outcome, signs: SignsOfLife) -> str:
        """State of the chip when a session has broken off, and the command to type."""
        if not signs.erased:
            return "nothing was written; type the same again"
        words = list(self._job.again)
        if outcome.eeprom_file and not outcome.chip.keeps_eeprom and "--eeprom" not in words:
            words += ["--eeprom", str(outcome.eeprom_file)]
        kept = f", its EEPROM is in {outcome.eeprom_file}" if outcome.eeprom_file else ""
        if signs.verified:
            state = "program and boot loader are written, the EEPROM may be not"
        else:
            state = "the chip is erased and half written, it runs nothing"
        return f"{state}{kept}; type: {shlex.join(words)}"

    def _read(self, names: Sequence[str]) -> dict[str, bytes]:
        with tempfile.TemporaryDirectory(prefix="kilotwin-") as folder:
            files = {name: Path(folder, name) for name in names}
            words = [word for name, file in files.items() for word in ("-U", f"{name}:r:{file}:r")]
            # -F: whether it is the right chip is judged here.
            self._run(["-F", *words], SignsOfLife())
            return {name: file.read_bytes() for name, file in files.items()}

    def _run(self, operations: list[str], signs: SignsOfLife, *, delicate: bool = False) -> None:
        avrdude.run(
            self._job.wiring, self._part, operations, self._progress, signs, delicate=delicate
        )


def _with(error: KilotwinError, state: str) -> KilotwinError:
    """The error with the state of the chip added to its line."""
    return type(error)(f"{error}; {state}", detail=error.detail)
