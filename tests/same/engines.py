"""Engines built by other compilers, and how a Python process takes one in place of its own."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
COMPILERS = {"gcc": "g++", "clang": "clang++"}
# Takes the engine's place in every Python process that finds it.
_SITECUSTOMIZE = """
import importlib.util, os, sys

class OtherEngine:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == "kilotwin._emulator":
            return importlib.util.spec_from_file_location(name, os.environ["OTHER_ENGINE"])

sys.meta_path.insert(0, OtherEngine)
"""


def build_engine(compiler: str, level: str, *targets: str) -> Path:
    """A build folder with the engine's module and other targets, robot programs built alike.

    It is below build/same/ and stays there, so that a second call is quick.
    CalledProcessError, with what was printed, where it fails.
    """
    folder = ROOT / "build" / "same" / f"{compiler}{level}"
    kind = level.removeprefix("-")
    configure = ["cmake", "-S", str(ROOT), "-B", str(folder), "-G", "Ninja"]
    configure += [f"-DPython_EXECUTABLE={sys.executable}", f"-DCMAKE_BUILD_TYPE={kind}"]
    configure += [f"-DCMAKE_{language}_FLAGS_{kind}={level}" for language in ("C", "CXX")]
    configure += ["-DKILOTWIN_TESTS=ON", f"-DKILOTWIN_GUEST_CFLAGS={level}"]
    build = ["cmake", "--build", str(folder), "--target", "_emulator", *targets]
    environment = {**os.environ, "CC": compiler, "CXX": COMPILERS[compiler]}
    for command in (configure, build):
        subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
    return folder


def outcomes(*words: str, variables: dict[str, str], before: tuple[str, ...] = ()) -> Any:
    """The JSON that `tests.same.outcome` prints with these words, in a process of its own.

    `variables` go into its environment, `before` stands in front of the command.
    CalledProcessError where it fails.
    """
    done = subprocess.run(
        [*before, sys.executable, "-m", "tests.same.outcome", *words],
        cwd=ROOT,
        env={**os.environ, **variables},
        stdout=subprocess.PIPE,
        check=True,
    )
    return json.loads(done.stdout)


def taking(build: Path, folder: Path) -> dict[str, str]:
    """The variables with which Python processes have the engine of a build folder.

    `folder`, which exists, gets the file by which they find it.
    """
    (module,) = build.rglob("_emulator*.so")
    (folder / "sitecustomize.py").write_text(_SITECUSTOMIZE)
    return {"OTHER_ENGINE": str(module), "PYTHONPATH": str(folder)}
