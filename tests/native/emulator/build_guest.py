"""build_guest.py PROGRAM GUEST.so [API]: builds a robot or module program for the native tests.

The host's own builder does it, found by PYTHONPATH: it needs nothing but Python's library.
"""

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

from kilotwin.errors import KilotwinError
from kilotwin.experiment.programs import find_program
from kilotwin.programs.native import guest as guest_build


def main() -> int:
    program, guest = sys.argv[1], Path(sys.argv[2])
    api: Any = sys.argv[3] if len(sys.argv) > 3 else None
    guest.parent.mkdir(parents=True, exist_ok=True)
    # The build system knows what is up to date; a cache beside it would only grow.
    with tempfile.TemporaryDirectory(dir=guest.parent) as cache:
        os.environ["KILOTWIN_CACHE"] = cache
        try:
            built = guest_build.build(find_program(program, Path.cwd(), api=api))
        except (KilotwinError, ValueError) as error:
            print(error, getattr(error, "detail", ""), sep="\n", file=sys.stderr)
            return 1
        built.file.replace(guest)
    return 0


if __name__ == "__main__":
    sys.exit(main())
