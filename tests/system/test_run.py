"""`kilotwin run`: what it prints, what it leaves, and what the paper's controllers do in it."""

from pathlib import Path
from typing import Any

import pytest

from .conftest import FIRAT, SIMPLIFIED, Kilotwin, RunJson

# Long enough that robots have met sites and one another, short enough for every test run.
SHORT = "duration_s=600"


@pytest.fixture
def short_run(run_json: RunJson) -> dict[str, Any]:
    return run_json(SIMPLIFIED, SHORT, "swarm.informed=0.3", seed=7)


def test_json_says_all_that_others_rely_on(short_run: dict[str, Any]) -> None:
    types: dict[str, type | tuple[type, ...]] = {
        "experiment": str,
        "seed": int,
        "duration_s": (int, float),
        "robots": int,
        "resting": dict,
        "not_resting": int,
        "informed": dict,
        "cpu_s": float,
        "wall_s": float,
        "robot_s_per_cpu_s": (int, float),
        "result_hash": str,
    }
    assert set(types) <= set(short_run)
    assert [key for key, kind in types.items() if not isinstance(short_run[key], kind)] == []
    assert short_run["seed"] == 7
    assert short_run["duration_s"] == 600
    assert short_run["robots"] == 100
    assert len(short_run["result_hash"]) == 16


def test_every_robot_is_counted_once(short_run: dict[str, Any]) -> None:
    assert set(short_run["resting"]) == {"black", "white"}
    assert sum(short_run["resting"].values()) + short_run["not_resting"] == 100
    assert sum(short_run["informed"].values()) == 30


def test_the_informed_are_rounded_half_up(run_json: RunJson) -> None:
    """Of 10 % of 50, half is 2.5: three for black, as in the paper."""
    halves = ("swarm.informed_for.black=0.5", "swarm.informed_for.white=0.5")
    settings = ("duration_s=2", "swarm.informed=0.1", *halves)
    got = run_json("experiments/paper/simplified-n50.toml", *settings)
    assert got["informed"] == {"black": 3, "white": 2}


def test_robots_gather_on_the_sites(run_json: RunJson) -> None:
    got = run_json(SIMPLIFIED, "duration_s=3000", "swarm.informed=0")
    assert sum(got["resting"].values()) > 10


def test_firat_with_nobody_informed_never_aggregates(run_json: RunJson) -> None:
    got = run_json(FIRAT, "duration_s=1500", "swarm.informed=0")
    assert got["resting"] == {"black": 0, "white": 0}
    assert got["not_resting"] == 100


def test_the_run_folder_holds_what_is_promised(kilotwin: Kilotwin, tmp_path: Path) -> None:
    out = tmp_path / "run"
    kilotwin("run", SIMPLIFIED, "--set", SHORT, "--out", out, "--json")
    names = {path.name for path in out.iterdir()}
    assert {"manifest.json", "experiment.toml", "robots.arrows", "sites.arrows"} <= names
    again = kilotwin("run", out / "experiment.toml", "--out", tmp_path / "again", "--json")
    assert '"result_hash"' in again.stdout


@pytest.mark.parametrize("figure", ["map", "timeline"])
def test_a_figure_of_a_run_is_a_picture(figure: str, kilotwin: Kilotwin, tmp_path: Path) -> None:
    kilotwin("run", SIMPLIFIED, "--set", SHORT, "--out", tmp_path / "run", "--json")
    picture = tmp_path / f"{figure}.png"
    kilotwin("plot", figure, tmp_path / "run", "-o", picture)
    assert picture.read_bytes().startswith(b"\x89PNG")
