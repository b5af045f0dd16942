"""Whole worlds give the same with several threads, and by the engine of another compiler."""

import subprocess
import sys

import pytest

from .engines import ROOT
from .outcome import SCENES, digest


@pytest.mark.parametrize("name", list(SCENES))
def test_three_threads_give_what_one_gives(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert digest(SCENES[name], threads=3) == digest(SCENES[name], threads=1)


@pytest.mark.long
def test_every_scene_is_the_same_by_gcc_and_clang_with_any_number_of_threads() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.same.run"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count(" = ") == len(SCENES)
