"""When a compiler that optimises is started beside a run, and what it makes."""

import subprocess
from pathlib import Path
from typing import Any

import pytest

from kilotwin.experiment.programs import find_program
from kilotwin.programs.native.guest import Guest
from kilotwin.programs.translate import optimiser
from kilotwin.programs.translate.translation import sources_of, translated_guest

ROOT = Path(__file__).resolve().parents[3]
TAKES_S = 4e-5 * 100_000


class Started:
    """In place of a process."""

    commands: list[list[str]]
    ended: int

    def __init__(self, command: list[str], **_: Any) -> None:
        Started.commands.append(command)

    def terminate(self) -> None:
        Started.ended += 1

    def wait(self) -> None:
        pass


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> type[Started]:
    Started.commands, Started.ended = [], 0
    monkeypatch.setattr("kilotwin.programs.translate.optimiser.subprocess.Popen", Started)
    return Started


@pytest.fixture
def guest(tmp_path: Path) -> Guest:
    faster = tmp_path / "walk.so"
    sources_of(faster).mkdir()
    (sources_of(faster) / "0.c").write_text(" " * 100_000)
    return Guest("walk", tmp_path / "quick.so", "key", "", optimised=faster)


def test_a_run_whose_rest_takes_longer_than_the_compiler_starts_it_once(
    guest: Guest, started: type[Started]
) -> None:
    with optimiser.Optimiser([guest]) as made:
        made.note(2, TAKES_S + 1)
        made.note(3, 100)
        assert [command[-1] for command in started.commands] == [str(guest.optimised)]
        assert started.ended == 0
    assert started.ended == 1


@pytest.mark.parametrize(("ran_s", "left_s"), [(0.5, 1000), (2, TAKES_S - 1)])
def test_a_short_run_does_not(
    guest: Guest, started: type[Started], ran_s: float, left_s: float
) -> None:
    with optimiser.Optimiser([guest]) as made:
        made.note(ran_s, left_s)
    assert started.commands == []


def test_nor_does_a_run_whose_code_is_optimised(tmp_path: Path, started: type[Started]) -> None:
    with optimiser.Optimiser([Guest("walk", tmp_path / "walk.so", "key", "")]) as made:
        made.note(100, 1000)
    assert started.commands == []


def test_what_it_makes_is_what_the_next_run_gets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KILOTWIN_CACHE", str(tmp_path))
    program = find_program(["firmware/examples/blink.c"], ROOT, [], [])
    first = translated_guest(program)
    assert first.optimised is not None
    with optimiser.Optimiser([first]) as made:
        made.note(2, 1000)
        process = made._process
        assert isinstance(process, subprocess.Popen)
        assert process.wait() == 0
    second = translated_guest(program)
    assert (second.file, second.optimised) == (first.optimised, None)
    assert second.key == first.key
