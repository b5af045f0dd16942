"""Loads a module of ours on first use; everywhere else they are imported at the top of a file.

`kilotwin --help` must not wait for every command's pyarrow, nor `kilotwin run` for matplotlib, nor
a run of robots for what drives a Kilogrid.
"""

import importlib
from typing import Any


def load(name: str) -> Any:
    """The module `kilotwin.NAME`."""
    return importlib.import_module(f"kilotwin.{name}")
