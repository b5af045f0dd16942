"""Trials whose programs mean harm to their sweep: each costs itself alone, and is named."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

KILOTWIN = Path(sys.executable).with_name("kilotwin")
HERE = Path(__file__).parent

BASE = """\
duration_s = 3
arena.diameter_m = 2.0
[swarm]
profile = "kilobot"
cpu = "native"
[record]
sample_s = 1
[[robots]]
program = "{here}/in_sweep.c"
define = ['VICTIM="{outside}/victim"', 'OUTSIDE="{outside}"', 'WAY={way}']
count = 2
"""
# By WAY: how the failed trial is told of; those that are not here finish.
FAILS = {3: "system call", 4: "", 5: "Segmentation fault", 6: ""}
WAYS = range(7)


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("sweep")
    outside = folder / "outside"
    outside.mkdir()
    (outside / "victim").write_text("mine")
    for way in WAYS:
        text = BASE.format(here=HERE, outside=outside, way=way)
        (folder / f"way-{way}.toml").write_text(text)
    bases = ", ".join(f'"way-{way}.toml"' for way in WAYS)
    (folder / "sweep.toml").write_text(f"base = [{bases}]\nseeds = 2\n")
    done = subprocess.run(
        [KILOTWIN, "sweep", folder / "sweep.toml", "--out", folder / "out", "--json", "-j", "2"],
        capture_output=True,
        text=True,
        check=False,
        timeout=240,
    )
    assert done.returncode == 1, done.stderr
    return folder, json.loads(done.stdout)


def test_nothing_outside_is_touched(swept: tuple[Path, dict[str, Any]]) -> None:
    outside = swept[0] / "outside"
    assert [file.name for file in outside.iterdir()] == ["victim"]
    assert (outside / "victim").read_text() == "mine"


def test_those_that_only_try_finish_and_the_others_fail_and_are_named(
    swept: tuple[Path, dict[str, Any]],
) -> None:
    failed = {(way, seed) for way in FAILS for seed in (1, 2)}
    told = {trial["trial"]: trial["failed"] for trial in swept[1]["failed"]}
    assert len(told) == len(failed)
    for trial, reason in told.items():
        way = int(trial.partition("way-")[2][0])
        assert FAILS[way] in reason, (trial, reason)
    table = pq.read_table(swept[0] / "out/trials.parquet").to_pylist()
    finished = {(int(row["base"][-1]), row["seed"]) for row in table}
    assert finished == {(way, seed) for way in WAYS for seed in (1, 2)} - failed


def test_harm_that_is_denied_changes_no_result(swept: tuple[Path, dict[str, Any]]) -> None:
    table = pq.read_table(swept[0] / "out/trials.parquet").to_pylist()
    of_seed_1 = {row["result_hash"] for row in table if row["seed"] == 1} if table else set()
    assert len(of_seed_1) <= 1
