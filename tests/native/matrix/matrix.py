"""matrix.py ROOT FOLDER build|compare: one run in two builds of the engine and its guests.

`build` makes them in FOLDER, where they stay, so that a second call is quick. `compare` runs each
and fails unless all print the same hash, and that hash is the one below.
"""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

# Hash of matrix_run.cpp. It changes with all that changes results, in the engine or in firmware.
# Put the new one here when such a change is meant.
GOLDEN = "853be7f9f2959ec9"

COMPILERS = {"gcc": "g++", "clang": "clang++"}
# The farthest apart; tests/system/test_same_engine.py, a long one, has six.
BUILDS = ["gcc-O3", "clang-O0"]
WORKERS = 2


def build(root: Path, folder: Path) -> None:
    compiler, level = folder.name.split("-")
    flags = f"-{level} -DNDEBUG" if level == "O3" else f"-{level}"
    configure: list[str | Path] = ["cmake", "-S", root, "-B", folder, "-G", "Ninja"]
    configure += [f"-DPython_EXECUTABLE={sys.executable}", f"-DCMAKE_BUILD_TYPE={level}"]
    configure += [f"-DCMAKE_C_COMPILER={compiler}", f"-DCMAKE_CXX_COMPILER={COMPILERS[compiler]}"]
    configure += [f"-DCMAKE_CXX_FLAGS_{level}={flags}", f"-DKILOTWIN_GUEST_CFLAGS=-{level}"]
    # In few large pieces, which is three times faster.
    configure += ["-DCMAKE_UNITY_BUILD=ON", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=20"]
    configure += ["-DKILOTWIN_TESTS=ON", "-DKILOTWIN_PYTHON=OFF"]
    make: list[str | Path] = ["cmake", "--build", folder, "--target", "matrix_run", "-j", "1"]
    for command in (configure, make):
        call(command)


def run(_: Path, folder: Path) -> str:
    return call([folder / "matrix_run"]).strip()


def call(command: list[str | Path]) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        words = " ".join(map(str, command))
        raise SystemExit(f"{words}\n{done.stdout}{done.stderr}")
    return done.stdout


def main() -> int:
    root, folder, what = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    task = {"build": build, "compare": run}[what]
    with ThreadPoolExecutor(WORKERS) as pool:
        results = list(pool.map(lambda name: task(root, folder / name), BUILDS))
    if what == "build":
        return 0
    for name, result in zip(BUILDS, results, strict=True):
        print(f"{name:9} {result}")
    if len(set(results)) > 1:
        print("The builds differ.")
        return 1
    found = str(results[0]).split()[0]
    if found != GOLDEN:
        print(f"All agree, but {Path(__file__).name} expects {GOLDEN}: what changed the result?")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
