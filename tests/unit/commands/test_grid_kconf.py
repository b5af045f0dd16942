"""`kilotwin grid kconf`: an experiment's configuration as the lab's tool takes it."""

import sys
from pathlib import Path

import pytest

from kilotwin.commands import cli
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec import kconf

from ..conftest import SMALL

ROOT = Path(__file__).parents[3]
EXPERIMENT = ROOT / "experiments/kilogrid/paper-n50.toml"


def run(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    monkeypatch.setattr(sys, "argv", ["kilotwin", "grid", "kconf", *words])
    with pytest.raises(SystemExit) as caught:
        cli.main()
    return int(caught.value.code or 0)


def test_what_is_printed_configures_modules_as_the_experiment_does(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, str(EXPERIMENT)) == 0
    plan = Experiment.load(EXPERIMENT).plan
    assert plan is not None
    blocks = kconf.parse(capfd.readouterr().out)
    printed = kconf.configurations(blocks, plan.layout.columns, plan.layout.rows)
    assert printed == {module: (data,) for module, data in plan.configuration.items()}


def test_without_a_grid_there_is_nothing_to_print(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], folder: Path
) -> None:
    (folder / "plain.toml").write_text(SMALL)
    assert run(monkeypatch, str(folder / "plain.toml")) == 2
    assert "there is no [grid]; add one with columns and rows" in capfd.readouterr().err
