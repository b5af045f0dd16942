"""The robots' boot loader on its chip, complete: after every power cut the program is sent again.

`make test` does that after each sixteenth (tests/native/bootloader/test_robot_loader.cpp).
"""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TESTS = ROOT / "build/engine/tests/native/bootloader/robot_loader_tests"


@pytest.mark.long
def test_after_a_power_cut_at_any_flash_operation_a_replacement_succeeds() -> None:
    run = subprocess.run(
        [TESTS, "--test-case=a power cut*"],
        env={**os.environ, "KILOTWIN_LONG": "1"},
        capture_output=True,
        text=True,
        timeout=1800,
        check=False,
    )
    assert run.returncode == 0, run.stdout
    assert "1 passed" in run.stdout
