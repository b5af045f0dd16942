"""A full CAN bus for 24 emulated hours, in the engine's own tests."""

import subprocess

import pytest
from tests.kept_table import ROOT

CASE = "a full bus of 51 nodes loses no frame in 24 hours*"


@pytest.mark.long
def test_a_full_bus_loses_no_frame_in_a_day() -> None:
    program = ROOT / "build/engine/tests/native/grid/grid_tests"
    command = [program, "--no-skip", f"--test-case={CASE}"]
    done = subprocess.run(
        list(map(str, command)), capture_output=True, text=True, timeout=7200, check=False
    )
    print(done.stdout)
    assert done.returncode == 0
    assert "1 passed" in done.stdout
