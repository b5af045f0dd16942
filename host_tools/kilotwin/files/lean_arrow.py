"""pyarrow without what it loads for nothing."""

import contextlib
import sys
import types
from collections.abc import Iterator

import pyarrow as pa

# File systems of clouds, for each of which pyarrow.fs does without.
_CLOUDS = frozenset({"pyarrow._azurefs", "pyarrow._gcsfs", "pyarrow._hdfs", "pyarrow._s3fs"})


# Whose objects pyarrow looks for in its first array.
_OTHERS = frozenset({"pandas", "dateutil"})


def leave_pandas_out() -> None:
    """Keeps this process from loading pandas for nothing, which takes longer than a short run.

    Where pandas is installed, pyarrow imports it at its first array, to see whether what it gets
    is of pandas, and dateutil likewise; ours never is. For processes of our own: both can be
    imported later, but their objects are not known to pyarrow then.
    """
    if "pandas" in sys.modules:
        return
    with _without(_OTHERS):
        pa.array([0])


def load_parquet() -> None:
    """Loads pyarrow.parquet, without file systems of clouds, and ssl for their certificates,
    unless they are there already.

    For processes of our own, which write to disks.
    """
    with _without(_CLOUDS), _without_certificates():
        import pyarrow.parquet  # noqa: F401


@contextlib.contextmanager
def _without_certificates() -> Iterator[None]:
    """With an ssl that knows of none, which is all that pyarrow asks it."""
    if "ssl" in sys.modules:
        yield
        return
    paths = types.SimpleNamespace(cafile=None, capath=None)
    knows_none = types.ModuleType("ssl")
    knows_none.__dict__["get_default_verify_paths"] = lambda: paths
    sys.modules["ssl"] = knows_none
    try:
        yield
    finally:
        del sys.modules["ssl"]


@contextlib.contextmanager
def _without(names: frozenset[str]) -> Iterator[None]:
    """In which these modules are not found."""
    finder = _Without(names)
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)


class _Without:
    """Finds none of these modules."""

    def __init__(self, names: frozenset[str]) -> None:
        self._names = names

    def find_spec(self, name: str, path: object, target: object = None) -> None:
        """ImportError for these; others are left to the next finder."""
        if name in self._names:
            raise ImportError(name)
