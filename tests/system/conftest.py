"""Shared by the system tests: they type the commands a person types and look at what comes out."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
KILOTWIN = Path(sys.executable).with_name("kilotwin")
SIMPLIFIED = "experiments/paper/simplified-n100.toml"
FIRAT = "experiments/paper/firat-n100.toml"

Kilotwin = Callable[..., "subprocess.CompletedProcess[str]"]
RunJson = Callable[..., dict[str, Any]]
Program = Callable[[str], str]

# A Kilobot that walks at random.
WALKER = """\
#include <kilolib.h>
static void setup(void) { rand_seed(rand_hard()); }
static void loop(void) {
    uint8_t dice = rand_soft();
    spinup_motors();
    set_motors(dice % 4 ? kilo_straight_left : 0, dice % 4 != 1 ? kilo_straight_right : 0);
    delay(500);
}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""


def block(text: str, language: str) -> str:
    """The first fenced block of that language in a document."""
    match = re.search(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert match, f"no {language} block"
    return match[1]


@pytest.fixture(scope="session")
def environment() -> dict[str, str]:
    return {**os.environ, "NO_COLOR": "1", "COLUMNS": "200"}


def kilotwin_in(environment: dict[str, str]) -> Kilotwin:
    """`kilotwin ARGUMENTS`, from the project's root or `folder`, with what it printed."""

    def call(
        *arguments: str | Path,
        expect: int = 0,
        env: dict[str, str] | None = None,
        timeout_s: float = 600,
        folder: Path = ROOT,
    ) -> subprocess.CompletedProcess[str]:
        done = subprocess.run(
            [KILOTWIN, *map(str, arguments)],
            cwd=folder,
            env={**environment, **(env or {})},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
            timeout=timeout_s,
        )
        assert done.returncode == expect, f"{arguments}\n{done.stdout}\n{done.stderr}"
        return done

    return call


@pytest.fixture(scope="session")
def kilotwin(environment: dict[str, str]) -> Kilotwin:
    return kilotwin_in(environment)


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Program:
    """The file of a program."""
    monkeypatch.chdir(tmp_path)

    def write(text: str) -> str:
        (tmp_path / "program.c").write_text(text)
        return "program.c"

    return write


@pytest.fixture
def run_json(kilotwin: Kilotwin, tmp_path: Path) -> RunJson:
    """`kilotwin run EXPERIMENT --set ... --json`: what it prints. Each run has its folder."""
    count = 0

    def run(
        experiment: str | Path, *settings: str, seed: int = 1, env: dict[str, str] | None = None
    ) -> dict[str, Any]:
        nonlocal count
        count += 1
        sets = [word for setting in settings for word in ("--set", setting)]
        out = tmp_path / f"run-{count}"
        seed_words = ["--seed", str(seed)]
        done = kilotwin("run", experiment, *sets, *seed_words, "--out", out, "--json", env=env)
        result = json.loads(done.stdout)
        assert isinstance(result, dict)
        return result

    return run
