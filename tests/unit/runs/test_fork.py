"""Work in a fork: what it says comes back, and one that does not end is ended."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.session import fork
from kilotwin.session.black_box import VARIABLE, BlackBox, Watch, stuck_s
from kilotwin.session.fork import Ended

AT_WORK = (7).to_bytes(8, "little") + (1).to_bytes(4, "little")


@pytest.fixture
def box(tmp_path: Path) -> BlackBox:
    """One of an engine that is at work, with robot 7."""
    (tmp_path / "box").write_bytes(AT_WORK)
    return BlackBox(tmp_path / "box")


def stay(_: fork.Say) -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    while True:
        time.sleep(1000)


def close_and_stay(say: fork.Say) -> None:
    os.closerange(3, 1000)
    stay(say)


def ended(work: Callable[[fork.Say], None], box: BlackBox, limit_s: float | None = None) -> Ended:
    """How a fork ends that is to say something, and does not."""
    with fork.Fork(work) as one:
        assert one.said(Watch(box), limit_s) is None
        return one.end()


def test_what_the_work_says_comes_back_one_thing_after_the_other(box: BlackBox) -> None:
    def work(say: fork.Say) -> None:
        for length in (1_000_000, 0, 3):
            say(b"x" * length)

    with fork.Fork(work) as one:
        assert [len(one.said(Watch(box)) or b"") for _ in range(3)] == [1_000_000, 0, 3]
        assert one.said(Watch(box)) is None
        assert one.end() == Ended(b"", 0)


def test_work_beyond_its_time_is_ended_whatever_signals_it_blocks(box: BlackBox) -> None:
    one = ended(stay, box, 0.5)
    assert (one.late, one.signal) == (True, signal.SIGKILL)


def test_work_that_changes_nothing_is_ended(box: BlackBox, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "1")
    one = ended(stay, box)
    assert (one.stuck, one.signal) == (True, signal.SIGKILL)


def test_work_that_closes_its_pipe_and_stays_is_ended(
    box: BlackBox, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fork, "_END_S", 0.5)
    assert ended(close_and_stay, box).signal == signal.SIGKILL


def test_a_fork_that_is_left_while_it_works_is_ended(box: BlackBox) -> None:
    with fork.Fork(stay) as one:
        pass
    assert one.end().signal == signal.SIGKILL


def test_a_fork_that_says_more_than_any_answer_is_ended(box: BlackBox) -> None:
    def work(say: fork.Say) -> None:
        os.write(say._send, b"\xff" * 100)

    assert len(ended(work, box).said) == 100


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
