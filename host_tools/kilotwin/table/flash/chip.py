"""An ATmega328P as a programmer shows it: signature, fuses, lock bits, EEPROM; and what they mean.

Fuse and lock bits are programmed when 0 (data sheet DS40002061, tables 27-1 to 27-9).
"""

from dataclasses import dataclass
from typing import Any

from kilotwin.files.headers import number_of

PARTS = {bytes.fromhex("1e950f"): "ATmega328P", bytes.fromhex("1e9514"): "ATmega328"}
"""The chips that a Kilobot may have, by signature."""

AVRDUDE_PARTS = {"ATmega328P": "m328p", "ATmega328": "m328"}
"""Their names for avrdude."""

_MAP = "firmware/kilolib/core/eeprom_map.h"
EEPROM_BYTES = number_of(_MAP, "EEPROM_BYTES")
_DUTIES = ("TURN_LEFT", "TURN_RIGHT", "STRAIGHT_LEFT", "STRAIGHT_RIGHT")

# Bits of the low, the high and the extended fuse byte.
_CKDIV8, _CLOCK, _INTERNAL_8_MHZ = 0x80, 0x0F, 0x02
_DWEN, _WDTON, _EESAVE, _BOOTSZ, _BOOTRST = 0x40, 0x10, 0x08, 0x06, 0x01
_BROWN_OUT = 0x07
# Lock bits: for programmers, for SPM and LPM in the application, in the boot section.
_LB, _BLB0, _BLB1 = 0x03, 0x0C, 0x30

LOADER_SECTION_BYTES = 4096
"""Size of the boot section that a loader needs."""


@dataclass(frozen=True)
class Chip:
    """A chip as it was read, before anything is written."""

    signature: bytes
    low: int
    high: int
    extended: int
    lock: int
    eeprom: bytes

    @property
    def part(self) -> str | None:
        """Its name; None if no Kilobot has such a chip."""
        return PARTS.get(self.signature)

    @property
    def boot_section_bytes(self) -> int:
        """512 to 4096, by the fuses BOOTSZ."""
        return LOADER_SECTION_BYTES >> ((self.high & _BOOTSZ) >> 1)

    @property
    def keeps_eeprom(self) -> bool:
        """Whether erasing the chip spares the EEPROM."""
        return not self.high & _EESAVE

    @property
    def readable(self) -> bool:
        """Whether lock bits let a programmer read it."""
        return bool(self.lock & _LB)

    @property
    def uid(self) -> int:
        """From the EEPROM; 65535 if it is erased."""
        at = number_of(_MAP, "EEPROM_UID")
        return int.from_bytes(self.eeprom[at : at + 2], "little")

    @property
    def duties(self) -> dict[str, int]:
        """The calibrated duties of the motors; 255 if erased."""
        return {name.lower(): self.eeprom[number_of(_MAP, f"EEPROM_{name}")] for name in _DUTIES}

    @property
    def calibrated(self) -> bool:
        """Whether there is anything in the EEPROM."""
        return self.eeprom != b"\xff" * len(self.eeprom)

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        return {
            "part": self.part,
            "signature": self.signature.hex(),
            "fuses": {"low": self.low, "high": self.high, "extended": self.extended},
            "lock_bits": self.lock,
            "boot_section_bytes": self.boot_section_bytes,
            "erase_keeps_eeprom": self.keeps_eeprom,
            "uid": self.uid if self.calibrated else None,
            "duties": self.duties if self.calibrated else None,
        }

    def text(self) -> str:
        """The same as a table."""
        eeprom = "erased: no uid, no calibration"
        if self.calibrated:
            duties = ", ".join(f"{name} {duty}" for name, duty in self.duties.items())
            eeprom = f"uid {self.uid}, {duties.replace('_', ' ')}"
        if not self.readable:
            eeprom = "cannot be read"
        boot = f"boot section {self.boot_section_bytes:,} bytes, start at "
        boot += "0x0000" if self.high & _BOOTRST else "the boot section"
        kept = "erasing keeps the EEPROM" if self.keeps_eeprom else "erasing loses the EEPROM"
        rows = [
            ("chip", f"{self.signature.hex(' ').upper()}  {self.part or 'unknown'}"),
            ("low fuse", f"0x{self.low:02X}  {self._clock()}"),
            ("high fuse", f"0x{self.high:02X}  {boot}, {kept}"),
            ("extended fuse", f"0x{self.extended:02X}  {self._brown_out()}"),
            ("lock bits", f"0x{self.lock:02X}  {self._locks()}"),
            ("EEPROM", eeprom),
        ]
        return "\n".join(f"  {name:<13}  {what}" for name, what in rows)

    def obstacle(self, avrdude: str, *, loader: bool) -> str | None:
        """Why it may not be written, with what to type; None if it may.

        `avrdude` is the command up to the port, `loader` whether there is to be one.
        """
        if self.part is None:
            return (
                f"the chip's signature is {self.signature.hex(' ').upper()}, not 1E 95 0F of an "
                "ATmega328P or 1E 95 14 of an ATmega328; plug in a Kilobot"
            )
        if loader and self.boot_section_bytes != LOADER_SECTION_BYTES:
            return (
                f"high fuse 0x{self.high:02X}: the boot section has {self.boot_section_bytes:,} "
                f"bytes and the boot loader needs {LOADER_SECTION_BYTES:,}; type: {avrdude} "
                f"-U hfuse:w:0x{self.high & ~_BOOTSZ:02X}:m"
            )
        if self.lock & _LB != _LB:
            return (
                f"lock bits 0x{self.lock:02X}: the chip may not be written; {self._open(avrdude)}"
            )
        if loader and self.lock & _BLB0 != _BLB0:
            return (
                f"lock bits 0x{self.lock:02X}: the boot loader may not read and write the "
                f"application; {self._open(avrdude)}"
            )
        return None

    def warnings(self) -> list[str]:
        """Oddities that do not hinder."""
        found = []
        if not self.keeps_eeprom:
            found.append("erasing loses the EEPROM (fuse EESAVE is off); it is written back")
        if self._clock() != _KILOBOT_CLOCK:
            found.append(f"the clock is no Kilobot's (low fuse): {self._clock()}")
        if not self.high & _WDTON:
            found.append("the watchdog is always on (fuse WDTON): most programs will be reset")
        if not self.high & _DWEN:
            found.append("debugWIRE is on (fuse DWEN): it may get in the programmer's way")
        if self.extended & _BROWN_OUT == _BROWN_OUT:
            found.append(
                "brown-out detection is off (extended fuse): an EEPROM may suffer when the battery "
                "runs down"
            )
        if self.lock & _BLB1 != _BLB1:
            found.append("the boot section is locked against SPM; erasing opens it")
        return found

    def _open(self, avrdude: str) -> str:
        kept = "" if self.keeps_eeprom else ", which loses the EEPROM"
        return f"erasing opens it{kept}; type: {avrdude} -e"

    def _clock(self) -> str:
        if self.low & _CLOCK != _INTERNAL_8_MHZ:
            return "another clock than the chip's own oscillator"
        return _KILOBOT_CLOCK if self.low & _CKDIV8 else "its own oscillator, divided: 1 MHz"

    def _brown_out(self) -> str:
        levels = {6: "1.8 V", 5: "2.7 V", 4: "4.3 V"}
        level = levels.get(self.extended & _BROWN_OUT)
        return f"reset below {level}" if level else "no brown-out detection"

    def _locks(self) -> str:
        if self.lock & _LB != _LB:
            return "not to be written" if self.readable else "neither to be written nor read"
        parts = {"application": _BLB0, "boot section": _BLB1}
        shut = [name for name, bits in parts.items() if self.lock & bits != bits]
        return f"open, but for the program: {', '.join(shut)}" if shut else "open"


_KILOBOT_CLOCK = "its own oscillator, 8 MHz"
