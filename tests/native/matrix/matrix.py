"""One run in two builds of the engine and its guests, this one and one that is far from it.

    matrix.py build ROOT FOLDER           makes the other one in FOLDER, where it stays
    matrix.py compare FOLDER MATRIX_RUN   runs both

fails unless both print the same hash, and that hash is the one below.
"""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

# Hash of matrix_run.cpp. It changes with all that changes results, in the engine or in firmware.
# Put the new one here when such a change is meant.
GOLDEN = "853be7f9f2959ec9"

# The farthest from gcc at -O3; tests/system/test_same_engine.py, a long one, has six.
COMPILERS = ("-DCMAKE_C_COMPILER=clang", "-DCMAKE_CXX_COMPILER=clang++")
LEVEL = "O0"


def build(root: str, folder: str) -> None:
    configure = ["cmake", "-S", root, "-B", folder, "-G", "Ninja", *COMPILERS]
    configure += [f"-DPython_EXECUTABLE={sys.executable}", f"-DCMAKE_BUILD_TYPE={LEVEL}"]
    configure += [f"-DCMAKE_CXX_FLAGS_{LEVEL}=-{LEVEL}", f"-DKILOTWIN_GUEST_CFLAGS=-{LEVEL}"]
    # In few large pieces, which is three times faster.
    configure += ["-DCMAKE_UNITY_BUILD=ON", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=20"]
    configure += ["-DKILOTWIN_TESTS=ON", "-DKILOTWIN_PYTHON=OFF"]
    call(configure)
    call(["cmake", "--build", folder, "--target", "matrix_run"])


def compare(folder: str, mine: str) -> int:
    """The exit code."""
    here, other = (call([program]).strip() for program in (mine, f"{folder}/matrix_run"))
    print(f"this build: {here}\nclang -{LEVEL}: {other}")
    if here != other:
        print("The builds differ.")
        return 1
    if here.split()[0] != GOLDEN:
        print(f"Both agree, but {Path(__file__).name} expects {GOLDEN}: what changed the result?")
        return 1
    return 0


def call(command: Sequence[str]) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    return done.stdout


if __name__ == "__main__":
    what, *words = sys.argv[1:]
    sys.exit({"build": build, "compare": compare}[what](*words))
