"""The file that a worker's engine writes into as it runs."""

import errno
import os
import struct
import tempfile
from pathlib import Path

import pytest
from tests.unit.conftest import Load

from kilotwin.errors import RunError
from kilotwin.session.black_box import BlackBox


def test_a_box_is_there_until_its_end_and_says_nothing_at_first() -> None:
    with BlackBox.made() as box:
        seen = box.seen()
        assert (seen.robots, seen.steps, seen.at_work) == ((), 0, False)
    assert not box.path.exists()


@pytest.mark.parametrize(
    ("robots", "words"),
    [
        ([(2, 17)], "PROGRAM robot 3 tick 17"),
        ([(0, 5), (1, 6)], "PROGRAM robot 1 tick 5 or PROGRAM robot 2 tick 6"),
        ([(2**32 - 1, 0), (1, 6)], "PROGRAM robot 2 tick 6"),  # a thread that has done its share
        ([(2**32 - 1, 0)] * 2, ""),
    ],
)
def test_robots_that_run_are_named_one_for_each_thread(
    load: Load, robots: list[tuple[int, int]], words: str
) -> None:
    experiment = load()
    program = experiment.program_of(0).name
    with BlackBox.made() as box:
        shares = [struct.pack("=II56x", *robot) for robot in robots]
        box.path.write_bytes(struct.pack("=QII48x", 9, 1, len(robots)) + b"".join(shares))
        assert box.ran_last(experiment) == words.replace("PROGRAM", program)


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
