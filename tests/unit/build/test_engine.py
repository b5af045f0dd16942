"""The engine as the compiler made it."""

import platform
import subprocess

import pytest

from kilotwin import _emulator


@pytest.mark.skipif(platform.machine() != "x86_64", reason="looks for an instruction of x86-64")
def test_records_of_large_swarms_are_fetched_early_in_the_engine_as_it_was_built() -> None:
    """gcc leaves out calls of functions that do nothing but prefetch, and says nothing."""
    code = subprocess.run(
        ["objdump", "--disassemble", "--no-show-raw-insn", _emulator.__file__],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert "prefetch" in code
