"""pydantic without plugins, which it looks for in everything that is installed."""

import os
import sys
import types

# Its part that looks, and loads importlib.metadata and the library for mail to do so.
_LOADER = "pydantic.plugin._loader"


def leave_plugins_out() -> None:
    """Keeps this process from looking for pydantic's plugins, unless it has loaded pydantic or
    PYDANTIC_DISABLE_PLUGINS says which of them to leave out.

    For processes of our own, before pydantic is loaded.
    """
    if "pydantic" in sys.modules or "PYDANTIC_DISABLE_PLUGINS" in os.environ:
        return
    has_none = types.ModuleType(_LOADER)
    has_none.__dict__["get_plugins"] = tuple
    sys.modules[_LOADER] = has_none
