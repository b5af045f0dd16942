"""Signals: two that come at once, as from `timeout` or make, are one."""

import os
import signal

import pytest

from kilotwin.files import interrupts


def test_a_second_signal_within_a_second_is_the_same_one(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [100.0]
    monkeypatch.setattr("kilotwin.files.interrupts.time.monotonic", lambda: clock[0])
    heard: list[float] = []
    with interrupts.heeding_interrupts(lambda *_: heard.append(clock[0])):
        for clock[0] in (100.0, 100.0, 100.9, 101.0, 101.5, 103.0):
            os.kill(os.getpid(), signal.SIGTERM)
    assert heard == [100.0, 101.0, 103.0]


def test_signals_of_two_kinds_within_a_second_are_one_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kilotwin.files.interrupts.time.monotonic", lambda: 100.0)
    heard: list[int] = []
    with interrupts.heeding_interrupts(lambda number, _: heard.append(number)):
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGTERM)
    assert heard == [signal.SIGINT]
