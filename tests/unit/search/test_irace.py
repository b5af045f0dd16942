"""The files that irace gets, and the lines by which it asks for trials; without irace."""

import math
import os
import stat
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from kilotwin.commands.terminal import SweepSilent
from kilotwin.errors import InputError, RunError
from kilotwin.studies.pool.places import Processes
from kilotwin.studies.search.irace import Race, race
from kilotwin.studies.search.optimise import Goal, Search
from kilotwin.studies.search.points import Laboratory
from kilotwin.studies.search.space import Point, parse_axes

OVER = [
    "controller.beta=1..4",
    "swarm.size=10..50:10",
    "robots.0.count=1..9",
    "medium.loss=0.001..0.5,log",
    "profile=kilobot|foot-bot",
]


def search(over: Sequence[str] = OVER, **how: Any) -> Search:
    axes = parse_axes(list(over))
    return Search(axes, [Goal("hops", "max")], points=20, repeats=3, confirm=0, **how)


def test_each_kind_of_key_is_a_row_of_parameters(tmp_path: Path) -> None:
    rows = Race.of(search(), tmp_path).files()["parameters.txt"].splitlines()[1:]
    assert rows == [
        'controller.beta\t""\tr (1, 4)',
        'swarm.size\t""\to ("10", "20", "30", "40", "50")',
        'robots.0.count\t""\ti (1, 9)',
        'medium.loss\t""\tr,log (0.001, 0.5)',
        'profile\t""\tc ("kilobot", "foot-bot")',
    ]


def test_the_scenario_has_the_budget_and_the_seed(tmp_path: Path) -> None:
    text = Race.of(search(seed=7), tmp_path).files()["scenario.txt"]
    assert "maxExperiments = 60\n" in text
    assert "seed = 7\n" in text


def test_a_line_is_a_point_with_a_seed(tmp_path: Path) -> None:
    made = Race.of(search(), tmp_path)
    words = ["controller.beta=1.5", "swarm.size=30", "robots.0.count=4", "medium.loss=0.01"]
    assert made.asked("@3\t271828\t" + "\t".join([*words, "profile=foot-bot"])) == (
        {
            "controller.beta": 1.5,
            "swarm.size": 30,
            "robots.0.count": 4,
            "medium.loss": 0.01,
            "profile": "foot-bot",
        },
        271828,
    )


def test_keys_that_irace_cannot_call_so_have_names_of_their_own(tmp_path: Path) -> None:
    made = Race.of(search(["states.mü=1..2", "states.mö=1..2"]), tmp_path)
    assert list(made.names) == ["states.m_", "states.m_.1"]
    assert made.point(["states.m_.1=2", "states.m_=1"]) == {"states.mö": 2, "states.mü": 1}


@pytest.mark.parametrize(
    ("how", "what"),
    [
        ({"prune": True}, "it gives points up by itself"),
        ({"goals": [Goal("hops", "max"), Goal("spread", "min")]}, "for one metric"),
    ],
)
def test_what_irace_does_not_do_is_refused(how: dict[str, Any], what: str, tmp_path: Path) -> None:
    axes = parse_axes(OVER)
    wanted = Search(axes, **{"goals": [Goal("hops", "max")], "points": 20, **how})
    with pytest.raises(InputError, match=what):
        Race.of(wanted, tmp_path)


class Fake(Laboratory):
    """Measures points by a formula; -1 has no value."""

    def make_folder(self) -> None:
        self.folder.mkdir()

    def measure_each(self, wanted: Any, share: float = 1.0) -> list[dict[str, float | None] | None]:
        asked: list[tuple[Point, int]] = list(wanted)
        return [
            None if point["x"] < 0 else {"hops": point["x"] * 10 + seed} for point, seed in asked
        ]


@pytest.fixture
def laboratory(tmp_path: Path) -> Laboratory:
    return Fake(Path("my.toml"), [], ["hops"], tmp_path / "out", Processes(1), SweepSilent())


@pytest.fixture
def rscript(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An Rscript that speaks as race.R does with irace."""
    folder = tmp_path / "bin"
    folder.mkdir()
    file = folder / "Rscript"
    file.write_text(
        f"#!{sys.executable}\n"
        + textwrap.dedent("""\
        import pathlib, sys

        assert pathlib.Path("parameters.txt").read_text().endswith('x\\t""\\tr (-2, 4)\\n')
        print("# 2026-11-29 01:59:35 UTC: Iteration 1 of 1")
        print("@ask 3\\n@1\\t5\\tx=1\\n@2\\t5\\tx=-1\\n@1\\t6\\tx=1", flush=True)
        costs = [sys.stdin.readline().strip() for _ in range(3)]
        print("costs", *costs)
        print("@elite x=1", flush=True)
        """)
    )
    file.chmod(file.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    return file


def test_a_batch_is_answered_by_costs_and_the_elite_is_the_best(
    rscript: Path, laboratory: Laboratory
) -> None:
    notes: list[str] = []
    found = race(search(["x=-2..4"]), laboratory, notes.append)
    log = (laboratory.folder / "irace/irace.log").read_text()
    assert "costs -15.0 inf -16.0\n" in log
    assert notes == ["irace: Iteration 1 of 1; 0 trials so far"]
    assert [(one.point, one.means, one.repeats) for one in found.front] == [
        ({"x": 1.0}, (15.5,), 2)
    ]
    assert [math.isnan(one.means[0]) for one in found.tried] == [False, True]


def test_irace_that_ends_without_a_result_is_told_with_its_last_words(
    rscript: Path, laboratory: Laboratory
) -> None:
    rscript.write_text("#!/bin/sh\necho 'Error: no way'; exit 1\n")
    with pytest.raises(RunError, match="irace ended without a result: Error: no way; see"):
        race(search(["x=-2..4"]), laboratory, lambda _: None)


def test_without_r_the_error_says_what_to_install(
    laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("shutil.which", lambda _: None)
    with pytest.raises(RunError, match="R is not installed; type: apt-get install r-cran-irace"):
        race(search(["x=-2..4"]), laboratory, lambda _: None)
