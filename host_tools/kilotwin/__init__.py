"""Kilotwin's host tools: experiments, runs, run folders and figures behind one command.

From Python: `from kilotwin import RGB, World`, see docs/python_api.md.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kilotwin.runs.world import RGB, World

    __version__: str

__all__ = ["RGB", "World", "__version__"]


def __getattr__(name: str) -> Any:
    """The Python API and the version, loaded on first use: `kilotwin --help` waits for neither.

    The engine knows the version, and tells it sooner than what is known of an installed package;
    the native build compiles guests without either.
    """
    if name == "__version__":
        try:
            return import_module("kilotwin._emulator").VERSION
        except ImportError:
            return import_module("importlib.metadata").version("kilotwin")
    if name in ("RGB", "World"):
        return getattr(import_module("kilotwin.runs.world"), name)
    raise AttributeError(f"module 'kilotwin' has no attribute '{name}'")
