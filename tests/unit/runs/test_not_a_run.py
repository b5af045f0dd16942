"""Whatever is named in place of a run folder is said to be that, with what to type."""

import os
from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.reader import Run


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with an experiment, a program, a sweep and runs, of which `second` is newer."""
    monkeypatch.chdir(tmp_path)
    for file in ("my.toml", "my.c", "sweep/sweep.json"):
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).touch()
    for age, name in enumerate(("first", "second")):
        folder = tmp_path / "runs" / name
        folder.mkdir(parents=True)
        (folder / "manifest.json").write_text("{}")
        os.utime(folder / "manifest.json", (1000 + age, 1000 + age))
    (tmp_path / "runs/first/map.png").touch()
    return tmp_path


@pytest.mark.parametrize(
    ("named", "said"),
    [
        ("my.toml", "an experiment, not a run; to see it run type: kilotwin run my.toml --view; "),
        ("my.toml", "else name the folder that a run of it left, as runs/second, runs/first"),
        ("my.c", "a file, not a run folder; name one that `kilotwin run` made, as runs/second, "),
        ("sweep", "a sweep, not a run; for all of its trials type: kilotwin plot series sweep -o "),
        (
            "runs",
            "not a run folder (no manifest.json); name one that `kilotwin run` made, as runs/",
        ),
        ("runs/third", "there is no such run folder; name one that `kilotwin run` made, as runs/"),
        ("runs/first", "not a run folder (no experiment.toml); name one"),
        ("runs/first/map.png", "a file of a run; name its folder: runs/first"),
        ("away/third", "there is no such run folder; name one that `kilotwin run` made, as runs/"),
    ],
)
def test_what_is_no_run_folder_is_named(named: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        Run.open(Path(named))
    assert str(refused.value).startswith(f"{named}: ")
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("named", "said"),
    [
        ("runs/first", "a run folder; to see it type: kilotwin view runs/first; again: kilotwin"),
        (".", "a folder; name an experiment's TOML file, as my.toml"),
        ("runs", "a folder; name an experiment's TOML file"),
    ],
)
def test_a_folder_that_is_named_in_place_of_an_experiment_is_named(named: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        Experiment.load(Path(named))
    assert said in str(refused.value)
