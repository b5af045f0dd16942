"""A long run of programs that run translated says, once, what native would take."""

from pathlib import Path
from typing import Any, cast

import pytest

from kilotwin.experiment.experiment import Experiment
from kilotwin.session.display import NoDisplay
from kilotwin.session.estimate import cpu_s_of
from kilotwin.session.run import _Child

EXPERIMENT = """\
seed = 1
duration_s = 4000
[arena]
shape = "circle"
diameter_m = 5
[swarm]
profile = "kilobot"
cpu = "{cpu}"
[[robots]]
program = "firmware/blank.c"
count = 1000
"""


class Notes(NoDisplay):
    """Keeps what is said."""

    def __init__(self) -> None:
        self.said: list[str] = []

    def note(self, text: str) -> None:
        self.said.append(text)


def said(folder: Path, cpu: str, moments: list[tuple[float, float]]) -> list[str]:
    file = folder / "long.toml"
    file.write_text(EXPERIMENT.format(cpu=cpu))
    notes = Notes()
    child: Any = _Child.__new__(_Child)
    child._job = type("Job", (), {"experiment": Experiment.load(file)})
    child._display, child._estimated = notes, False
    for ran_s, whole_s in moments:
        cast(_Child, child)._say_what_native_takes(ran_s, whole_s)
    return notes.said


def test_it_says_so_once_it_is_known_that_it_takes_more_than_a_minute(tmp_path: Path) -> None:
    [line] = said(tmp_path, "auto", [(1, 80), (4, 80), (8, 85)])
    assert line.startswith("takes about 80 s; --set swarm.cpu=native would take about 10 s of CPU")


@pytest.mark.parametrize(("cpu", "whole_s"), [("auto", 40), ("auto", 15), ("native", 500)])
def test_a_shorter_run_and_a_native_one_do_not(cpu: str, whole_s: float, tmp_path: Path) -> None:
    assert said(tmp_path, cpu, [(4, whole_s), (8, whole_s)]) == []


def test_translated_robots_are_taken_to_be_slower_than_native_ones(tmp_path: Path) -> None:
    (tmp_path / "one.toml").write_text(EXPERIMENT.format(cpu="translated"))
    experiment = Experiment.load(tmp_path / "one.toml")
    assert cpu_s_of(experiment, natively=True) == pytest.approx(10)
    assert cpu_s_of(experiment) == pytest.approx(80)
