"""A run takes faster code of its programs over while it goes on, also where it is confined."""

import json
from pathlib import Path
from typing import Any

import pytest

from kilotwin import _emulator
from kilotwin.experiment.experiment import Experiment
from kilotwin.programs.group import build_all
from kilotwin.programs.translate.translation import optimise
from kilotwin.session.display import NoDisplay
from kilotwin.session.run import run

EXPERIMENT = """
name = "faster"
seed = 3
duration_s = 20
[arena]
shape = "circle"
diameter_m = 0.5
[swarm]
profile = "kilobot"
floor = false
[[robots]]
program = "firmware/examples/random_walk_counter.c"
cpu = "translated"
count = 8
"""


def run_of(file: Path, folder: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    outcome = run(Experiment.load(file), folder, [], NoDisplay())
    return json.loads((folder / "manifest.json").read_text()), outcome.summary


def test_a_confined_run_takes_it_over_and_says_when(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KILOTWIN_CACHE", str(tmp_path / "cache"))
    file = tmp_path / "faster.toml"
    file.write_text(EXPERIMENT)
    manifest, alone = run_of(file, tmp_path / "alone")
    assert "faster_code_from_s" not in manifest
    built = build_all(Experiment.load(file))
    faster = built[0][0].optimised
    assert faster is not None
    optimise(faster)
    # As if it had come when the run had just begun.
    monkeypatch.setattr("kilotwin.session.run.build_all", lambda *_, **__: built)
    manifest, taken = run_of(file, tmp_path / "taken")
    assert manifest["faster_code_from_s"] == 0
    assert manifest["confined"] == (not _emulator.lacking_layers())
    assert taken["result_hash"] == alone["result_hash"]
