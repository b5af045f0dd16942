"""`make fuzz`: feeds every decoder for a minute each; or so many inputs, in `make check-long`.

    python -m tests.fuzz.run [NAME ...] [--seconds 60 | --runs 10000000] [--seed 1]

Inputs that broke something are kept in build/fuzz; what libFuzzer found worth keeping is in
tests/fuzz/corpus, and `--keep` brings that up to date.
"""

import argparse
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

from . import native_targets, python_fuzz
from .native_targets import NATIVE, ROOT
from .python_targets import PYTHON

FOLDER = ROOT / "build/fuzz"
CORPUS = Path(__file__).with_name("corpus")
NAMES = (*NATIVE, *PYTHON)


def corpus_of(name: str, folder: Path) -> Path:
    """A folder with the seeds and what is kept from earlier sessions."""
    corpus = folder / f"{name}-corpus"
    corpus.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(NATIVE[name].seeds()):
        (corpus / f"seed-{number}").write_bytes(seed)
    kept = CORPUS / f"{name}.zip"
    if kept.is_file():
        with zipfile.ZipFile(kept) as pack:
            pack.extractall(corpus)
    return corpus


def fuzz(name: str, folder: Path, *, runs: int, seconds: float, seed: int = 1) -> int:
    """One decoder; how many inputs it took. AssertionError for a finding."""
    folder.mkdir(parents=True, exist_ok=True)
    if name in PYTHON:
        found = folder / f"{name}-finding"
        return python_fuzz.fuzz(PYTHON[name], found, runs=runs, seconds=seconds, seed=seed)
    program = native_targets.build(name, folder)
    limits = [f"-runs={runs}", f"-max_total_time={round(seconds)}"]
    return native_targets.run(program, corpus_of(name, folder), limits, NATIVE[name].longest)


def keep(name: str, folder: Path) -> None:
    """Packs the fewest inputs that reach all that was reached."""
    corpus, least = corpus_of(name, folder), folder / f"{name}-least"
    shutil.rmtree(least, ignore_errors=True)
    least.mkdir()
    command = [folder / name, "-merge=1", least, corpus]
    subprocess.run(list(map(str, command)), check=True, capture_output=True, cwd=folder)
    CORPUS.mkdir(exist_ok=True)
    with zipfile.ZipFile(CORPUS / f"{name}.zip", "w", zipfile.ZIP_DEFLATED) as pack:
        for file in sorted(least.iterdir()):
            pack.writestr(zipfile.ZipInfo(file.name), file.read_bytes(), zipfile.ZIP_DEFLATED)


def main() -> int:
    parser = argparse.ArgumentParser(prog="make fuzz", description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(NAMES)}")
    parser.add_argument("--runs", type=int, help="so many inputs each, however long they take")
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true", help="renew tests/fuzz/corpus")
    arguments = parser.parse_args()
    for unknown in set(arguments.names) - set(NAMES):
        parser.error(f"{unknown} is none of {', '.join(NAMES)}")
    runs, seconds = arguments.runs or sys.maxsize, arguments.seconds
    if arguments.runs:
        seconds = 24 * 3600
    for name in arguments.names or NAMES:
        began = time.monotonic()
        count = fuzz(name, FOLDER, runs=min(runs, 2**31 - 1), seconds=seconds, seed=arguments.seed)
        took_s = time.monotonic() - began
        print(f"{name:14} {count:12,} inputs in {took_s:6.0f} s, nothing found", flush=True)
        if arguments.keep and name in NATIVE:
            keep(name, FOLDER)
    return 0


if __name__ == "__main__":
    sys.exit(main())
