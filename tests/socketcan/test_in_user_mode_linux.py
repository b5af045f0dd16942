"""Runs the tests on real SocketCAN in a User-Mode Linux kernel, since this one has none."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from kilotwin.experiment.experiment import Experiment
from kilotwin.programs.group import build_group

HERE = Path(__file__).parent
ROOT = HERE.parents[1]


def run_there(tests: Path, folder: Path, timeout_s: int, **environment: str) -> None:
    """Every test of a file, in a kernel that has SocketCAN."""
    if shutil.which("linux.uml") is None:
        pytest.skip("neither SocketCAN in this kernel nor User-Mode Linux: make setup installs it")
    told = {"PYTHONDONTWRITEBYTECODE": "1", **environment}
    command = (
        " ".join(f"{key}={value}" for key, value in told.items())
        + f" {sys.executable} -m pytest -q -s -p no:cacheprovider"
        f" --basetemp={folder}/there --rootdir={ROOT} -c {ROOT}/pyproject.toml {tests}"
    )
    done = subprocess.run(
        [HERE / "uml" / "run", folder, command],
        check=False,
        env={**os.environ, "UML_TIMEOUT_S": str(timeout_s)},
    )
    kernel, output = folder / "kernel", folder / "output"
    text = output.read_text(errors="replace") if output.exists() else ""
    assert done.returncode != 125, (
        f"User-Mode Linux did not come to an end:\n{kernel.read_text(errors='replace')}{text}"
    )
    assert done.returncode == 0, text
    passed = re.search(r"(\d+) passed", text)
    assert passed is not None, text
    assert int(passed[1]) == tests.read_text().count("\ndef test_"), text


@pytest.mark.socketcan
def test_the_bridge_on_socketcan_in_user_mode_linux(tmp_path: Path) -> None:
    run_there(HERE / "test_bridge_on_socketcan.py", tmp_path, 120)


@pytest.mark.socketcan
@pytest.mark.long
def test_a_whole_table_on_socketcan_in_user_mode_linux(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = tmp_path / "guests"
    monkeypatch.setenv("KILOTWIN_CACHE", str(cache))
    experiment = Experiment.load(ROOT / "experiments/kilogrid/paper-n50.toml", [])
    assert experiment.modules is not None
    for group in (*experiment.groups, experiment.modules):
        build_group(group)
    tests = HERE / "test_table_on_socketcan.py"
    run_there(tests, tmp_path, 900, KILOTWIN_CACHE=str(cache))
