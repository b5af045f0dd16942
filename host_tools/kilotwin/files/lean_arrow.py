"""pyarrow without pandas."""

import sys
from importlib.abc import MetaPathFinder

import pyarrow as pa


def leave_pandas_out() -> None:
    """Keeps this process from loading pandas for nothing, which takes longer than a short run.

    Where pandas is installed, pyarrow imports it at its first array, to see whether what it gets
    is of pandas; ours never is. For processes of our own: pandas can be imported later, but its
    objects are not known to pyarrow then.
    """
    if "pandas" in sys.modules:
        return
    sys.meta_path.insert(0, _WithoutPandas())
    try:
        pa.array([0])
    finally:
        del sys.meta_path[0]


class _WithoutPandas(MetaPathFinder):
    """Finds no pandas."""

    def find_spec(self, name: str, path: object, target: object = None) -> None:
        """ImportError for pandas; others are left to the next finder."""
        if name == "pandas":
            raise ImportError(name)
