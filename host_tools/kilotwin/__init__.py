"""Kilotwin's host tools: experiments, runs, run folders and figures behind one command.

From Python: `from kilotwin import RGB, Trials, World`, see docs/python_api.md.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kilotwin.session.world import RGB, World
    from kilotwin.studies.pool.trials import Trials

    __version__: str

__all__ = ["RGB", "Trials", "World", "__version__"]


def __getattr__(name: str) -> Any:
    """The Python API and the version, loaded on first use: `kilotwin --help` waits for neither.

    The engine knows the version, and tells it sooner than what is known of an installed package;
    the native build compiles guests without either.
    """
    if name == "__version__":
        try:
            from kilotwin._emulator import VERSION
        except ImportError:
            from importlib.metadata import version

            return version("kilotwin")
        return VERSION
    if name in ("RGB", "World"):
        from kilotwin.session import world

        return getattr(world, name)
    if name == "Trials":
        from kilotwin.studies.pool.trials import Trials

        return Trials
    raise AttributeError(f"module 'kilotwin' has no attribute '{name}'")
