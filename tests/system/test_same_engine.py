"""Same seed, same result, however the engine was compiled: gcc or clang, -O0, -O1 or -O3.

Builds the engine anew for each, which takes minutes: `make check-long`.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.same.engines import COMPILERS, build_engine, taking

from .conftest import ROOT, SIMPLIFIED, RunJson

GOLDEN = ROOT / "tests/native/golden/hash.txt"


@pytest.mark.long
@pytest.mark.parametrize("level", ["-O0", "-O1", "-O3"])
@pytest.mark.parametrize("compiler", list(COMPILERS))
def test_every_build_of_the_engine_gives_the_same(
    compiler: str, level: str, run_json: RunJson, tmp_path: Path
) -> None:
    folder = build_engine(compiler, level, "golden_run")
    golden = subprocess.run([folder / "golden_run"], check=True, capture_output=True, text=True)
    assert golden.stdout.split()[0] == GOLDEN.read_text().strip()

    settings = ("duration_s=1200", "swarm.informed=0.2")
    expected = run_json(SIMPLIFIED, *settings, seed=11)["result_hash"]
    other = {"KILOTWIN_CC": compiler, **taking(folder, tmp_path)}
    say = "import json, kilotwin._emulator as e; print(json.dumps([e.__file__, e.BUILD]))"
    told = subprocess.run(
        [sys.executable, "-c", say], env={**os.environ, **other}, check=True, capture_output=True
    )
    file, build = json.loads(told.stdout)
    assert file == other["OTHER_ENGINE"]
    assert level.removeprefix("-") in build
    assert run_json(SIMPLIFIED, *settings, seed=11, env=other)["result_hash"] == expected
