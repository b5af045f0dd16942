"""Pseudo terminals, and who has a port open."""

import fcntl
import os
import tty
from pathlib import Path

import pytest

from kilotwin.errors import DeviceError, InputError
from kilotwin.table.ports.holders import reserved
from kilotwin.table.ports.pseudo_terminal import PseudoTerminal


@pytest.fixture
def port() -> str:
    """A port that no program has open; it stays until the process ends."""
    _, theirs = os.openpty()
    tty.setraw(theirs)
    name = os.ttyname(theirs)
    os.close(theirs)
    return name


def test_bytes_pass_both_ways_as_they_are() -> None:
    terminal = PseudoTerminal()
    assert terminal.read(0.0) is None  # no program has it open
    other = os.open(terminal.port, os.O_RDWR | os.O_NOCTTY)
    every = bytes(range(256))
    os.write(other, every)
    assert terminal.read(1) == every
    assert terminal.read(0) == b""
    terminal.write(every)
    assert os.read(other, 1000) == every
    os.close(other)
    assert terminal.read(0) is None
    terminal.write(b"nobody reads this")
    terminal.close()
    assert not Path(terminal.port).exists()


def test_what_nobody_takes_is_lost_and_does_not_block() -> None:
    terminal = PseudoTerminal()
    other = os.open(terminal.port, os.O_RDWR | os.O_NOCTTY)
    terminal.write(b"x" * 200_000)
    os.close(other)
    terminal.close()


def test_a_link_leads_to_the_port_and_goes_with_it(tmp_path: Path) -> None:
    link = tmp_path / "isp"
    link.symlink_to("/dev/pts/old")  # of one that was killed
    terminal = PseudoTerminal(link)
    assert str(link.readlink()) == terminal.port
    assert terminal.shown == str(link)
    terminal.close()
    assert not link.is_symlink()


def test_a_link_of_somebody_else_stays(tmp_path: Path) -> None:
    link = tmp_path / "isp"
    terminal = PseudoTerminal(link)
    link.unlink()
    link.symlink_to("/dev/another")
    terminal.close()
    assert link.is_symlink()
    PseudoTerminal().close()


def test_a_link_that_cannot_be_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("precious")
    with pytest.raises(InputError, match="there is a file of that name"):
        PseudoTerminal(tmp_path / "file")
    assert (tmp_path / "file").read_text() == "precious"
    with pytest.raises(InputError, match="no such file or directory; name another"):
        PseudoTerminal(tmp_path / "no" / "link")


def test_a_free_port_is_reserved_and_names_that_are_no_file_pass(port: str) -> None:
    with reserved(port), reserved("usb"):
        pass


def test_a_port_that_is_locked_is_refused(port: str) -> None:
    file = os.open(port, os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(file, fcntl.LOCK_EX)
    with pytest.raises(DeviceError, match="is in use by another program; end that first"):
        reserved(port).__enter__()
    os.close(file)


def test_ports_that_cannot_be_opened_are_told_apart(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for name, said in (
        ("none", "none is not there; plug it in"),
        ("file", "file is no serial port"),
        ("", "cannot be opened: is a directory"),
    ):
        with pytest.raises(DeviceError, match=said):
            reserved(str(tmp_path / name)).__enter__()


def test_a_port_without_the_right_to_it_says_how_to_get_it(
    port: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> int:
        raise PermissionError

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(DeviceError, match="may not be opened by you; type: sudo usermod"):
        reserved(port).__enter__()
