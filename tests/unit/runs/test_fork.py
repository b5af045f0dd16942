"""Work in a fork: what it says comes back, and one that does not end is ended."""

import os
import signal
import time
from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.session import fork
from kilotwin.session.black_box import VARIABLE, BlackBox, Watch, stuck_s

AT_WORK = (7).to_bytes(4, "little") + bytes(12) + (1).to_bytes(4, "little")


@pytest.fixture
def box(tmp_path: Path) -> BlackBox:
    """One of an engine that is at work, with robot 7."""
    (tmp_path / "box").write_bytes(AT_WORK)
    return BlackBox(tmp_path / "box")


def stay() -> bytes:
    signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    while True:
        time.sleep(1000)


def close_and_stay() -> bytes:
    os.closerange(3, 1000)
    return stay()


def test_what_the_work_returns_comes_back(box: BlackBox) -> None:
    ended = fork.in_fork(lambda: b"x" * 1_000_000, Watch(box))
    assert (len(ended.said), ended.signal, ended.late, ended.stuck) == (
        1_000_000,
        None,
        False,
        False,
    )


def test_work_beyond_its_time_is_ended_whatever_signals_it_blocks(box: BlackBox) -> None:
    ended = fork.in_fork(stay, Watch(box), 0.5)
    assert (ended.late, ended.signal) == (True, signal.SIGKILL)


def test_work_that_changes_nothing_is_ended(box: BlackBox, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "1")
    ended = fork.in_fork(stay, Watch(box))
    assert (ended.stuck, ended.signal) == (True, signal.SIGKILL)


def test_work_that_closes_its_pipe_and_stays_is_ended(
    box: BlackBox, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fork, "_END_S", 0.5)
    assert fork.in_fork(close_and_stay, Watch(box)).signal == signal.SIGKILL


def test_a_watch_wants_a_change_at_work_and_ten_times_as_seldom_between_calls(
    box: BlackBox, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, "3")
    watch = Watch(box)
    assert [watch.is_stuck() for _ in range(4)] == [False, False, False, True]
    box.path.write_bytes(bytes(len(AT_WORK)))
    assert [watch.is_stuck() for _ in range(31)].index(True) == 30
    watch.heard()
    assert not watch.is_stuck()


def test_a_box_that_a_program_has_cut_is_read(box: BlackBox) -> None:
    box.path.write_bytes(b"\xff")
    assert not box.seen().at_work


@pytest.mark.parametrize("written", ["", "0", "-1", "1.5", "1000000", "soon"])
def test_a_time_that_is_none_is_refused(written: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, written)
    with pytest.raises(InputError, match=f"{VARIABLE}={written}: must be a whole number"):
        stuck_s()
