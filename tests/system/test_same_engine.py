"""Same seed, same result, however the engine was compiled: gcc or clang, -O0, -O1 or -O3.

Builds the engine anew for each, which takes minutes: `make check-long`.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from .conftest import ROOT, SIMPLIFIED, RunJson

GOLDEN = ROOT / "tests/native/golden/hash.txt"
COMPILERS = {"gcc": "g++", "clang": "clang++"}
# Takes the engine's place in every Python process of a run.
SITECUSTOMIZE = """
import importlib.util, os, sys

class OtherEngine:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == "kilotwin._emulator":
            return importlib.util.spec_from_file_location(name, os.environ["OTHER_ENGINE"])

sys.meta_path.insert(0, OtherEngine)
"""


def build_engine(compiler: str, level: str) -> Path:
    """A build folder with the engine's module and golden_run, whose robot programs are built alike.

    It is below build/same/ and stays there, so that a second call is quick.
    """
    folder = ROOT / "build" / "same" / f"{compiler}{level}"
    kind = level.removeprefix("-")
    configure = ["cmake", "-S", str(ROOT), "-B", str(folder), "-G", "Ninja"]
    configure += [f"-DPython_EXECUTABLE={sys.executable}", f"-DCMAKE_BUILD_TYPE={kind}"]
    configure += [f"-DCMAKE_{language}_FLAGS_{kind}={level}" for language in ("C", "CXX")]
    configure += ["-DKILOTWIN_TESTS=ON", f"-DKILOTWIN_GUEST_CFLAGS={level}"]
    build = ["cmake", "--build", str(folder), "--target", "_emulator", "golden_run"]
    environment = {**os.environ, "CC": compiler, "CXX": COMPILERS[compiler]}
    for command in (configure, build):
        subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
    return folder


@pytest.mark.long
@pytest.mark.parametrize("level", ["-O0", "-O1", "-O3"])
@pytest.mark.parametrize("compiler", list(COMPILERS))
def test_every_build_of_the_engine_gives_the_same(
    compiler: str, level: str, run_json: RunJson, tmp_path: Path
) -> None:
    folder = build_engine(compiler, level)
    golden = subprocess.run([folder / "golden_run"], check=True, capture_output=True, text=True)
    assert golden.stdout.split()[0] == GOLDEN.read_text().strip()

    (module,) = folder.rglob("_emulator*.so")
    settings = ("duration_s=1200", "swarm.informed=0.2")
    expected = run_json(SIMPLIFIED, *settings, seed=11)["result_hash"]
    (tmp_path / "sitecustomize.py").write_text(SITECUSTOMIZE)
    other = {
        "OTHER_ENGINE": str(module),
        "PYTHONPATH": str(tmp_path),
        "KILOTWIN_CC": compiler,
    }
    say = "import json, kilotwin._emulator as e; print(json.dumps([e.__file__, e.BUILD]))"
    told = subprocess.run(
        [sys.executable, "-c", say], env={**os.environ, **other}, check=True, capture_output=True
    )
    file, build = json.loads(told.stdout)
    assert file == other["OTHER_ENGINE"]
    assert level.removeprefix("-") in build
    assert run_json(SIMPLIFIED, *settings, seed=11, env=other)["result_hash"] == expected
