"""Kilotwin's host tools: experiments, runs, run folders and figures behind one command.

From Python: `from kilotwin import RGB, World`, see docs/python_api.md.
"""

from importlib import metadata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kilotwin.runs.world import RGB, World

    __version__: str

__all__ = ["RGB", "World", "__version__"]


def __getattr__(name: str) -> Any:
    """The Python API, loaded when it is asked for: `kilotwin --help` does not wait for it.

    And the version, known where the package is installed: guests are built without it, too.
    """
    if name == "__version__":
        return metadata.version("kilotwin")
    if name in ("RGB", "World"):
        from kilotwin.runs import world  # noqa: PLC0415

        return getattr(world, name)
    raise AttributeError(f"module 'kilotwin' has no attribute '{name}'")
