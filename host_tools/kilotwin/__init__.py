"""Kilotwin's host tools: experiments, runs, run folders and figures behind one command.

From Python: `from kilotwin import RGB, World`, see docs/python_api.md.
"""

from importlib.metadata import version
from typing import TYPE_CHECKING, Any

__version__ = version("kilotwin")

if TYPE_CHECKING:
    from kilotwin.world import RGB, World

__all__ = ["RGB", "World", "__version__"]


def __getattr__(name: str) -> Any:
    """The Python API, loaded when it is asked for: `kilotwin --help` does not wait for it."""
    if name in ("RGB", "World"):
        from kilotwin import world  # noqa: PLC0415

        return getattr(world, name)
    raise AttributeError(f"module 'kilotwin' has no attribute '{name}'")
