"""Serial ports as `kilotwin doctor` lists them."""

import os
import subprocess
import sys
import tty
from collections.abc import Iterator

import pytest
from serial.tools.list_ports_common import ListPortInfo

from kilotwin.commands import doctor
from kilotwin.table.ports.list_ports import ports


def info(device: str, vid: int | None, pid: int | None, product: str | None) -> ListPortInfo:
    found = ListPortInfo(device, skip_link_detection=True)
    found.vid, found.pid, found.product = vid, pid, product
    return found


@pytest.fixture
def terminal() -> Iterator[str]:
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    yield os.ttyname(theirs)
    os.close(ours)
    os.close(theirs)


def test_a_dispatcher_is_known_by_its_chip_and_others_by_what_they_say(terminal: str) -> None:
    found = ports(
        [
            info("/dev/none2", 0x2341, 0x43, "Arduino Uno"),
            info("/dev/none1", 0x1234, 1, None),
            info("/dev/ttyS0", None, None, None),
            info(terminal, 0x0403, 0x6001, "FT232R USB UART"),
        ]
    )
    assert [port.name for port in found] == ["/dev/none1", "/dev/none2", terminal]
    assert [port.what for port in found] == [
        "",
        "Arduino Uno",
        "FTDI: a dispatcher, or another device with this chip",
    ]
    assert [port.may_open for port in found] == [False, False, True]
    assert str(found[0]) == "/dev/none1 (may not be opened by you)"
    assert str(found[2]) == f"{terminal} ({found[2].what})"


def test_who_has_a_port_open_is_said(terminal: str) -> None:
    wait = f"import os; os.open({terminal!r}, os.O_RDWR | os.O_NOCTTY); print(1); input()"
    with subprocess.Popen(
        [sys.executable, "-c", wait], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0
    ) as other:
        assert other.stdout is not None
        other.stdout.readline()
        (port,) = ports([info(terminal, 0x0403, 0x6001, None)])
        other.kill()
    assert port.holder is not None
    assert port.holder.endswith(f" (process {other.pid})")
    assert f"in use by {port.holder}" in str(port)


def test_the_doctor_names_them(monkeypatch: pytest.MonkeyPatch, terminal: str) -> None:
    dispatcher = info(terminal, 0x0403, 0x6001, None)
    missing = info("/dev/none", 0x2341, 0x43, "Arduino Uno")
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [dispatcher])
    finding = doctor._serial_ports()
    assert finding.found == f"{terminal} (FTDI: a dispatcher, or another device with this chip)"
    assert finding.remedy == ""
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [dispatcher, missing])
    assert "usermod" in doctor._serial_ports().remedy
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    assert doctor._serial_ports().found == "none"
