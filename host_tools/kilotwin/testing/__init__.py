"""Tests of robots' programs by pytest: the plugin, and assertions on samples.

`from kilotwin.testing import assert_share, assert_within`, see docs/testing.md.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kilotwin.testing.asserts import assert_share, assert_within

__all__ = ["assert_share", "assert_within"]


def __getattr__(name: str) -> Any:
    """Loaded on first use: pytest loads this package for its plugin, in any project."""
    if name in __all__:
        return getattr(import_module("kilotwin.testing.asserts"), name)
    raise AttributeError(f"module 'kilotwin.testing' has no attribute '{name}'")
