"""docs/parameters.md does what it says: a program's own parameters reach its robots."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from .conftest import ROOT, Kilotwin

DOCUMENT = (ROOT / "docs/parameters.md").read_text()
(PROGRAM,) = re.findall(r"^```c\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)
WIRE, EXPERIMENT = re.findall(r"^```toml\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)
(SHELL,) = re.findall(r"^```sh\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    (tmp_path / "walker.c").write_text(PROGRAM)
    (tmp_path / "walker.wire.toml").write_text(WIRE)
    (tmp_path / "walker.toml").write_text(EXPERIMENT)
    return tmp_path


def test_the_lines_of_the_document_run_and_robots_have_their_parameters(
    kilotwin: Kilotwin, lab: Path
) -> None:
    first, second, search, table = SHELL.splitlines()
    done = kilotwin(*shlex.split(first)[1:], "--json", folder=lab)
    found = json.loads(done.stdout)["metrics"]
    assert (found["step"]["value"], found["turns"]["value"]) == (46, 128)
    kilotwin(*shlex.split(second)[1:], folder=lab)
    kilotwin(*shlex.split(search)[1:], folder=lab)
    kept = (lab / "runs/straight/experiment.toml").read_text()
    assert "step_s = 3.3" in kept
    assert 'look = "blue"' in kept
    words = [sys.executable, *shlex.split(table)[1:]]
    printed = subprocess.run(words, cwd=lab, check=True, capture_output=True, text=True).stdout
    assert "| `parameters.turn_share` | number from 0 up to 1 | must be given |" in printed


@pytest.mark.parametrize("cpu", ["translated", "avr"])
def test_robots_of_machine_code_are_told_too(cpu: str, kilotwin: Kilotwin, lab: Path) -> None:
    (lab / "walker.toml").write_text(EXPERIMENT[: EXPERIMENT.index("[metric.step]")])
    words = ("--set", f"swarm.cpu={cpu}", "--set", "swarm.size=2", "--set", "duration_s=3")
    kilotwin("run", "walker.toml", *words, "--out", "run", "-q", folder=lab)
    states = pq.read_table(lab / "run/robots.parquet")["state"].to_pylist()
    assert states[-2:] == ["RGB(0,0,1)"] * 2
