"""pyarrow without what it loads for nothing."""

import subprocess
import sys

_ARRAYS = """
import sys
import numpy as np
import pyarrow as pa
from kilotwin.files.lean_arrow import leave_pandas_out
if "lean" in sys.argv: leave_pandas_out()
pa.record_batch([pa.array(["word"]), np.arange(1.0)], names=["a", "b"])
print("pandas" in sys.modules)
import pandas
print(pa.table({"x": [1]}).to_pandas().x[0])
"""


def loads_pandas(*arguments: str) -> str:
    words = [sys.executable, "-c", _ARRAYS, *arguments]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout


def test_arrays_load_no_pandas_and_it_can_still_be_imported() -> None:
    assert loads_pandas("lean") == "False\n1\n"
    assert loads_pandas() == "True\n1\n", "pyarrow loads it no more: lean_arrow.py can go"


_PARQUET = """
import sys
from kilotwin.files.lean_arrow import load_parquet
load_parquet()
print("pyarrow.parquet" in sys.modules, "pyarrow._s3fs" in sys.modules, "ssl" in sys.modules)
import ssl
print(ssl.create_default_context().verify_mode.name)
"""


def test_parquet_is_loaded_without_clouds_and_their_certificates() -> None:
    words = [sys.executable, "-c", _PARQUET]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout == "True False False\nCERT_REQUIRED\n"
