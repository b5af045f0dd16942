"""A run loads no library that a plain install leaves out."""

import subprocess
import sys

from kilotwin.files.extras import EXTRAS


def test_a_run_loads_no_library_of_an_extra() -> None:
    code = (
        "import sys, kilotwin.commands.run, kilotwin.runs.worker; "
        f"print(sorted(sys.modules.keys() & {sorted(EXTRAS)}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
