"""Runs the tests on real SocketCAN in a User-Mode Linux kernel, since this one has none."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
TESTS = HERE / "test_bridge_on_socketcan.py"


@pytest.mark.socketcan
def test_on_socketcan_in_user_mode_linux(tmp_path: Path) -> None:
    if shutil.which("linux.uml") is None:
        pytest.skip("neither SocketCAN in this kernel nor User-Mode Linux: make setup installs it")
    command = (
        f"PYTHONDONTWRITEBYTECODE=1 {sys.executable} -m pytest -q -p no:cacheprovider"
        f" --rootdir={HERE.parents[1]} -c {HERE.parents[1] / 'pyproject.toml'} {TESTS}"
    )
    done = subprocess.run([HERE / "uml" / "run", tmp_path, command], check=False)
    kernel, output = tmp_path / "kernel", tmp_path / "output"
    text = output.read_text(errors="replace") if output.exists() else ""
    assert done.returncode != 125, (
        f"User-Mode Linux did not come to an end:\n{kernel.read_text(errors='replace')}{text}"
    )
    assert done.returncode == 0, text
    passed = re.search(r"(\d+) passed", text)
    assert passed is not None, text
    assert int(passed[1]) == TESTS.read_text().count("\ndef test_"), text
