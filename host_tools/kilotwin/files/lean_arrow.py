"""pyarrow without what it loads for nothing."""

import sys
from importlib.abc import MetaPathFinder

import pyarrow as pa

# File systems of clouds, for each of which pyarrow.fs does without.
_CLOUDS = frozenset({"pyarrow._azurefs", "pyarrow._gcsfs", "pyarrow._hdfs", "pyarrow._s3fs"})


def leave_pandas_out() -> None:
    """Keeps this process from loading pandas for nothing, which takes longer than a short run.

    Where pandas is installed, pyarrow imports it at its first array, to see whether what it gets
    is of pandas; ours never is. For processes of our own: pandas can be imported later, but its
    objects are not known to pyarrow then.
    """
    if "pandas" in sys.modules:
        return
    sys.meta_path.insert(0, _Without(frozenset({"pandas"})))
    try:
        pa.array([0])
    finally:
        del sys.meta_path[0]


def load_parquet() -> None:
    """Loads pyarrow.parquet, without file systems of clouds unless they are there already.

    For processes of our own, which write to disks.
    """
    sys.meta_path.insert(0, _Without(_CLOUDS))
    try:
        import pyarrow.parquet  # noqa: F401, PLC0415
    finally:
        del sys.meta_path[0]


class _Without(MetaPathFinder):
    """Finds none of these modules."""

    def __init__(self, names: frozenset[str]) -> None:
        self._names = names

    def find_spec(self, name: str, path: object, target: object = None) -> None:
        """ImportError for these; others are left to the next finder."""
        if name in self._names:
            raise ImportError(name)
