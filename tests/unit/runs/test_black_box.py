"""The file that a worker's engine writes into as it runs."""

import errno
import os
import tempfile
from pathlib import Path

import pytest

from kilotwin.errors import RunError
from kilotwin.session.black_box import BlackBox


def test_a_box_is_there_until_its_end_and_says_nothing_at_first() -> None:
    with BlackBox.made() as box:
        seen = box.seen()
        assert (seen.robot, seen.tick, seen.steps, seen.at_work) == (0, 0, 0, False)
    assert not box.path.exists()


def test_a_disk_without_room_is_named_and_nothing_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = tmp_path / "begun"
    begun.touch()
    full = os.open("/dev/full", os.O_WRONLY)
    monkeypatch.setattr(tempfile, "mkstemp", lambda prefix: (full, str(begun)))
    with pytest.raises(RunError, match=r"cannot write .*; make room"), BlackBox.made():
        pass
    assert not begun.exists()


def test_a_folder_where_nothing_can_be_made_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(prefix: str) -> tuple[int, str]:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(tempfile, "mkstemp", refuse)
    with pytest.raises(RunError, match=r"cannot write .*; make room"), BlackBox.made():
        pass
