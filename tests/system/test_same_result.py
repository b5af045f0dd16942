"""Same seed, same result: on an idle and on a busy machine, and with either compiler's guests."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from .conftest import SIMPLIFIED, RunJson

SETTINGS = ("duration_s=600", "swarm.informed=0.2")


@pytest.fixture
def busy_machine() -> Iterator[None]:
    """Another process that computes all the while."""
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as other:
        yield
        other.kill()


@pytest.fixture
def first(run_json: RunJson) -> dict[str, Any]:
    return run_json(SIMPLIFIED, *SETTINGS, seed=11)


def test_a_second_run_gives_the_same(first: dict[str, Any], run_json: RunJson) -> None:
    assert run_json(SIMPLIFIED, *SETTINGS, seed=11)["result_hash"] == first["result_hash"]


@pytest.mark.usefixtures("busy_machine")
def test_a_busy_machine_gives_the_same(first: dict[str, Any], run_json: RunJson) -> None:
    assert run_json(SIMPLIFIED, *SETTINGS, seed=11)["result_hash"] == first["result_hash"]


def test_another_seed_gives_another(first: dict[str, Any], run_json: RunJson) -> None:
    assert run_json(SIMPLIFIED, *SETTINGS, seed=12)["result_hash"] != first["result_hash"]


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_either_compiler_builds_the_same_robots(
    compiler: str, first: dict[str, Any], run_json: RunJson, tmp_path: Path
) -> None:
    env = {"KILOTWIN_CC": compiler, "KILOTWIN_CACHE": str(tmp_path / "guests")}
    got = run_json(SIMPLIFIED, *SETTINGS, seed=11, env=env)
    assert got["result_hash"] == first["result_hash"]


def test_what_is_recorded_does_not_change_the_result(
    first: dict[str, Any], run_json: RunJson
) -> None:
    got = run_json(SIMPLIFIED, *SETTINGS, "record.sample_s=1", seed=11)
    assert got["final_hash"] == first["final_hash"]
