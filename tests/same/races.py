"""Steps all scenes with 2, 3 and 8 threads under ThreadSanitizer: `make tsan`, which builds for it.

    python -m tests.same.races build/tsan

The engine's module is the one of that build folder; gcc's ThreadSanitizer is loaded before Python.
It reports races of the engine: robots' programs, Box2D and Python are not built with it. Results
are held against those of one thread by the installed engine. It ends with code 1 where a race was
reported or a result differs.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from .engines import outcomes, taking

THREADS = ("2", "3", "8")


def main() -> int:
    """The exit code."""
    build = Path(sys.argv[1])
    library = subprocess.run(
        ["gcc", "-print-file-name=libtsan.so"], check=True, capture_output=True, text=True
    ).stdout.strip()
    expected = outcomes("--threads", "1", variables={})["outcomes"]
    with tempfile.TemporaryDirectory(prefix="kilotwin-tsan-") as folder:
        sanitized = {"LD_PRELOAD": library, "TSAN_OPTIONS": "exitcode=66 second_deadlock_stack=1"}
        # It wants its memory where this kernel would not put it by chance.
        try:
            told = outcomes(
                "--threads",
                *THREADS,
                variables={**sanitized, **taking(build, Path(folder))},
                before=("setarch", "--addr-no-randomize"),
            )
        except subprocess.CalledProcessError as error:
            sys.exit(f"tests.same.outcome ended with code {error.returncode}; its words are above")
    found = told["outcomes"]
    other = [
        f"{scene}, {threads} threads"
        for scene, by_threads in found.items()
        for threads, digest in by_threads.items()
        if digest != expected[scene]["1"]
    ]
    print(f"{len(found)} scenes, {' and '.join(THREADS)} threads: no race")
    print(f"another result: {', '.join(other)}" if other else "results as of one thread")
    return int(bool(other))


if __name__ == "__main__":
    sys.exit(main())
