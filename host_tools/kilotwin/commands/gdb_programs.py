"""Which gdb there is that knows AVR."""

import shutil

GDBS = ("avr-gdb", "gdb-multiarch")
"""Programs of Debian's packages gdb-avr and gdb-multiarch."""


def find_gdb() -> str | None:
    """The first that is here; None if none is."""
    return next(filter(None, map(shutil.which, GDBS)), None)
