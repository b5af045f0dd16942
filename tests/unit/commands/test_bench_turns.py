"""Commands that take turns: one goes on at a time, and none outlives the others."""

import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from kilotwin.studies.bench.turns import Command, take_turns

# Writes, once it has seen the other one stopped, fifty times whether it still is or has ended.
CHILD = """
import os, pathlib, psutil, sys, time
me, other = map(pathlib.Path, sys.argv[1:])

def stopped():
    try:
        return psutil.Process(int(other.read_text())).status() in ("stopped", "zombie")
    except FileNotFoundError:
        return False
    except psutil.NoSuchProcess:
        return True

me.with_suffix(".new").write_text(str(os.getpid()))
me.with_suffix(".new").rename(me)
while not stopped():
    time.sleep(0.001)
for _ in range(50):
    time.sleep(0.01)
    print(stopped(), flush=True)
"""
PARENT = "import subprocess, sys; sys.exit(subprocess.call([sys.executable, '-c', *sys.argv[1:]]))"


def begin(*words: str | Path, out: int | None = None) -> Command:
    """A command whose child does the work, as a run's worker does."""
    command = [sys.executable, "-c", PARENT, *map(str, words)]
    return subprocess.Popen(command, stdout=out, text=True)


def test_one_goes_on_while_the_other_and_its_children_are_stopped(tmp_path: Path) -> None:
    names = [tmp_path / name for name in ("one", "other")]
    commands = [
        begin(CHILD, *files, out=subprocess.PIPE) for files in (names, list(reversed(names)))
    ]
    assert take_turns(commands) is None
    for command in commands:
        assert command.stdout is not None
        assert command.stdout.read().split() == ["True"] * 50
        command.stdout.close()


@pytest.mark.parametrize("place", [0, 1])
def test_of_one_that_fails_is_told_and_the_other_is_killed_with_its_children(place: int) -> None:
    sleep = f"import time; time.sleep(1000 + {place})"
    commands = [begin(sleep)]
    commands.insert(place, begin("raise SystemExit(7)"))
    failed = take_turns(commands)
    assert failed is commands[place]
    assert failed.returncode == 7
    assert commands[1 - place].returncode == -9
    # Its child has another parent now, wherever it is.
    left = [one for one in psutil.process_iter(["cmdline"]) if sleep in (one.info["cmdline"] or [])]
    assert psutil.wait_procs(left, timeout=30)[1] == []


def test_an_exception_ends_all(monkeypatch: pytest.MonkeyPatch) -> None:
    def wait(self: Command, timeout: float | None = None) -> int:
        monkeypatch.undo()
        raise KeyboardInterrupt

    commands = [begin("import time; time.sleep(1000)") for _ in range(2)]
    monkeypatch.setattr(subprocess.Popen, "wait", wait)
    with pytest.raises(KeyboardInterrupt):
        take_turns(commands)
    assert [command.returncode for command in commands] == [-9, -9]
