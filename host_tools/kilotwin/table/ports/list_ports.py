"""The serial ports of this machine, with what may be at each and which program has it open."""

import os
from collections.abc import Iterable
from dataclasses import dataclass

from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from kilotwin.table.ports.holders import name_holder

# USB ids of an FTDI FT232R, which dispatchers have (hardware.md 3.1), and many adapters.
_FTDI = (0x0403, 0x6001)


@dataclass(frozen=True)
class Port:
    """A serial port."""

    name: str
    what: str
    """The device at it, for people; "" if it is not known."""
    holder: str | None
    """The process that has it open, "cat (process 12)"; None: free, or not to be seen by us."""
    may_open: bool

    def __str__(self) -> str:
        about = [part for part in (self.what, self.holder and f"in use by {self.holder}") if part]
        if not self.may_open:
            about.append("may not be opened by you")
        return f"{self.name} ({', '.join(about)})" if about else self.name


def this_computer_has() -> str:
    """`this computer has /dev/ttyACM0, /dev/ttyUSB0`, of serial ports."""
    names = [info.device for info in list_ports.comports()]
    return f"this computer has {', '.join(sorted(names)) or 'none now'}"


def ports(found: Iterable[ListPortInfo] | None = None) -> list[Port]:
    """All that this machine has, by name; `found` in place of what it says."""
    infos = list_ports.comports() if found is None else found
    return [
        Port(
            info.device,
            _what(info),
            name_holder(info.device),
            os.access(info.device, os.R_OK | os.W_OK),
        )
        for info in sorted(infos, key=lambda info: str(info.device))
        # A PC's own ttyS are listed whether anything is wired to them or not.
        if info.vid is not None
    ]


def _what(info: ListPortInfo) -> str:
    if (info.vid, info.pid) == _FTDI:
        return "FTDI: a dispatcher, or another device with this chip"
    named = info.product or info.description
    return "" if named in (None, "n/a") else str(named)
