"""Programmers for the tests: the served one, and one that is unplugged at the worst time."""

import contextlib
import json
import subprocess
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path

from kilotwin.files.memories import write_memories
from kilotwin.table.flash import chip_file
from kilotwin.table.ports.pseudo_terminal import PseudoTerminal

from .conftest import KILOTWIN

# uid 12 with its duties, as kilolib keeps them (hardware.md 1.9); all else is told by its address.
CALIBRATION = {0x05: 70, 0x09: 71, 0x0C: 72, 0x14: 73, 0xB0: 12, 0xB1: 0}
KEEPS_EEPROM, LOSES_EEPROM = 0xD1, 0xD9
SMALL_BOOT_SECTION = 0xD7
PROGRAM_FLASH = b"\x0e\x13"  # the token of STK500 version 2, and the command
READ_FLASH = b"\x0e\x14"


def eeprom_of_a_robot() -> bytes:
    return bytes(CALIBRATION.get(address, address * 7 & 0xFF) for address in range(1024))


def make_chip(
    file: Path,
    *,
    high_fuse: int = KEEPS_EEPROM,
    lock_bits: int = 0xFF,
    signature: str = "1e950f",
    loader: bytes = b"",
    first: bytes = b"\x0c\x94\x00\x00",
) -> Path:
    """A robot that has been used: calibrated, an old program in it, perhaps a boot loader."""
    segments = {
        0: first + bytes(252),
        chip_file.EEPROM_BASE: eeprom_of_a_robot(),
        chip_file.FUSE_BASE: bytes([0xE2, high_fuse, 0xFD]),
        chip_file.LOCK_BASE: bytes([lock_bits]),
        chip_file.SIGNATURE_BASE: bytes.fromhex(signature)[::-1],
    }
    write_memories(file, segments | ({0x7000: loader} if loader else {}))
    return file


@contextlib.contextmanager
def serving(chip: Path, environment: Mapping[str, str]) -> Iterator[str]:
    """`kilotwin serve programmer --chip FILE`; gives the port. Ended as by Ctrl-C."""
    with subprocess.Popen(
        [KILOTWIN, "serve", "programmer", "--chip", chip, "--json"],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        try:
            yield json.loads(process.stdout.readline())["port"]
        finally:
            process.terminate()
        _, errors = process.communicate(timeout=600)
        assert process.returncode == 0, errors


class BadProgrammer:
    """A programmer in a thread of the test; what goes wrong with it is in disturb()."""

    def __init__(self, chip: Path) -> None:
        self._chip = chip
        self._programmer = chip_file.plug_in(chip)
        self._terminal = PseudoTerminal()
        self._thread = threading.Thread(target=self._serve)
        self._ended = threading.Event()
        self._pages = 0
        self.failed = threading.Event()
        """When it went wrong."""

    def __enter__(self) -> str:
        self._thread.start()
        return self._terminal.port

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join(600)
        self._terminal.close()
        assert self.failed.is_set(), "nothing went wrong"
        chip_file.save(self._chip, self._programmer)

    def _serve(self) -> None:
        while not self._ended.is_set():
            data = self._terminal.read(0.1)
            if not data:
                continue
            self._pages += data.count(PROGRAM_FLASH)
            if not self.disturb(data):
                self._terminal.write(self._programmer.receive(data))

    def disturb(self, data: bytes) -> bool:
        """Called with what comes in; whether it is lost then."""
        raise NotImplementedError


class Unplugged(BadProgrammer):
    """One whose cable is pulled in the middle of its n-th page of flash.

    Or, with `hangs`, one that does not answer any more.
    """

    def __init__(self, chip: Path, page: int, *, hangs: bool = False) -> None:
        super().__init__(chip)
        self._page, self._hangs = page, hangs

    def disturb(self, data: bytes) -> bool:
        if self._pages < self._page or self.failed.is_set():
            return self.failed.is_set()
        self._programmer.receive(data[: len(data) // 2])
        if not self._hangs:
            self._terminal.close()
            self._ended.set()
        self.failed.set()
        return True


class WornChip(BadProgrammer):
    """One with a chip that loses a bit after it was written."""

    def disturb(self, data: bytes) -> bool:
        if self._pages and READ_FLASH in data and not self.failed.is_set():
            flash = bytearray(self._programmer.flash)
            flash[8] ^= 0x10
            self._programmer.flash = bytes(flash)
            self.failed.set()
        return False
