"""Experiments as Kilogrid labs write them: module program, robot program, .kconf; from Python."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from kilotwin import World
from kilotwin.errors import InputError, RunError
from kilotwin.files import resources
from kilotwin.studies.sweep.plan import read_plan
from kilotwin.studies.sweep.runner import Sweep

HERE = Path(__file__).parent
HAS_HEARD_S = 5
PHEROMONE = HERE / "pheromone" / "pheromone.toml"
OPINIONS = HERE / "opinions" / "opinions.toml"
RED, GREEN, BLUE, MAGENTA, CYAN = 1, 2, 4, 5, 6
CELL_M = 0.05
MODULES = 4


def cell_of(poses: NDArray[np.float32]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """(row, column) of the cells below robots."""
    place = np.floor(poses[:, :2] / CELL_M).astype(np.intp) + MODULES
    place = np.clip(place, 0, 2 * MODULES - 1)
    return place[:, 1], place[:, 0]


def visits(world: World, for_s: float) -> NDArray[np.int_]:
    """How many robots stood on each cell, summed over a look each second."""
    seen = np.zeros((2 * MODULES, 2 * MODULES), dtype=np.int_)
    for _ in range(int(for_s)):
        world.run(1)
        np.add.at(seen, cell_of(world.poses), 1)
    return seen


def obstacles() -> NDArray[np.bool_]:
    """The cells that arena.kconf makes obstacles: the edge, and one in the middle."""
    cells = np.ones((2 * MODULES, 2 * MODULES), dtype=np.bool_)
    cells[1:-1, 1:-1] = False
    cells[3, 3] = True
    return cells


def test_pheromone_grows_where_robots_are() -> None:
    with World(PHEROMONE, set=["grid.configuration=free.kconf"]) as world:
        seen = visits(world, 10)
        little = world.cells[..., 1].astype(float)
        seen += visits(world, 90)
        pheromone = world.cells[..., 1].astype(float)
        assert (world.cells[..., 0][pheromone > 0] == GREEN).all()
    assert pheromone.sum() > 3 * little.sum() > 0
    assert pheromone[seen >= 10].mean() > 4 * pheromone[seen <= 1].mean()
    # A robot is heard by the cells around it too, but not farther.
    far = np.pad(seen, 1)
    near = sum(far[1 + dy : 9 + dy, 1 + dx : 9 + dx] for dy in (-1, 0, 1) for dx in (-1, 0, 1))
    assert not pheromone[near == 0].any()


def test_robots_avoid_obstacle_cells() -> None:
    shares = {}
    for floor in ("arena.kconf", "free.kconf"):
        with World(PHEROMONE, set=[f"grid.configuration={floor}"]) as world:
            world.run(20)
            if floor == "arena.kconf":
                shown = world.cells[..., 0] == RED
                assert (shown == obstacles()).all()
            seen = visits(world, 240)
        shares[floor] = seen[obstacles()].sum() / seen.sum()
    assert shares["arena.kconf"] < 0.7 * shares["free.kconf"], shares


def test_reports_arrive_and_tell_what_robots_were_told() -> None:
    with World(PHEROMONE) as world:
        world.run(120)
        reports = world.reports
        assert [event["kind"] for event in world.grid_events] == ["set_up", "configure", "run"]
    heard = {report["robot"] for report in reports}
    assert heard == set(range(6))
    # One attempt in two seconds, of which a little more than half are heard.
    assert 6 * 60 * 0.25 < len(reports) < 6 * 60 * 1.3
    for report in reports:
        if report["time_s"] < HAS_HEARD_S:
            continue  # it may not have had a message yet
        # The module whose message it had is the one that receives it, or the next one.
        column, row = report["data"][1:3]
        assert abs(column - report["module_x"]) <= 1
        assert abs(row - report["module_y"]) <= 1


def test_robots_find_the_commoner_colour_and_cells_show_their_votes() -> None:
    with World(OPINIONS) as world:
        assert world.states.count("blue") < world.size
        world.run(240)
        assert world.states.count("red") >= 9
        shown = world.cells[..., 0]
        assert {BLUE, RED} <= set(np.unique(shown).tolist())
        assert MAGENTA in shown
        told = [report for report in world.reports if report["time_s"] > 200]
        assert len({report["robot"] for report in told}) >= 8
        assert sum(report["data"][2] == 2 for report in told) > 0.9 * len(told)


def test_the_host_pauses_and_goes_on() -> None:
    with World(PHEROMONE) as world:
        world.run(10)
        world.host.pause()
        world.run(6)
        before = world.poses
        world.run(10)
        assert np.allclose(world.poses, before)
        assert {module["state"] for module in world.modules} == {"idle"}
        world.host.resume()
        world.run(20)
        assert not np.allclose(world.poses, before)
        assert world.tick > 0


def test_a_world_without_a_grid_has_no_host() -> None:
    with World(program=HERE / "pheromone" / "ant.c") as world, pytest.raises(InputError):
        _ = world.cells


def test_a_grid_needs_no_file() -> None:
    with World(
        program=HERE / "pheromone" / "ant.c",
        count=3,
        grid={"columns": 2, "rows": 2, "buses": 1, "hold_s": 0.2},
    ) as world:
        world.run(30)
        assert world.cells.shape == (4, 4, 2)
        assert world.reports
    with pytest.raises(RunError, match="this world is closed"):
        _ = world.cells


def test_a_sweep_runs_a_trial_again_when_the_modules_program_has_changed(tmp_path: Path) -> None:
    for file in PHEROMONE.parent.iterdir():
        shutil.copy(file, tmp_path)
    sweep_file = tmp_path / "sweep.toml"
    sweep_file.write_text('name = "s"\nbase = "pheromone.toml"\n')

    def keys(folder: str) -> list[str]:
        return list(Sweep.prepare(read_plan(sweep_file), tmp_path / folder, lambda _: None).keys)

    before = keys("a")
    module = tmp_path / "ModuleMain.c"
    module.write_text(module.read_text().replace("DEPOSIT 16", "DEPOSIT 17"))
    assert keys("b") != before


def test_robots_of_collective_perception_agree_on_a_colour_that_there_is() -> None:
    """With short times, on a few modules of option 0 or 1; which one so few agree on is chance."""
    folder = "experiments/kilogrid/collective-perception"
    with World(
        program=resources.path(f"{folder}/robot.c"),
        define=["EXPLORATION_MEAN_S=15.0f", "DISSEMINATION_MEAN_S=40.0f"],
        count=12,
        grid={
            "columns": 3,
            "rows": 3,
            "buses": 1,
            "hold_s": 0.2,
            "program": str(resources.path(f"{folder}/cell.c")),
            "configuration": str(HERE / "opinions" / "mostly_red.kconf"),
            "cells": {"weak_share": 0.0},
        },
    ) as world:
        world.run(20)
        shown = world.cells[..., 0]
        assert np.count_nonzero(shown == RED) == 4 * 7
        assert np.count_nonzero(shown == BLUE) == 4 * 2
        world.run(220)
        reports = world.reports
    opinion, state, action = (
        np.array([report["data"][byte] for report in reports]) for byte in (1, 2, 3)
    )
    time_s = np.array([report["time_s"] for report in reports])
    assert set(opinion[time_s < 10]) >= {0, 1, 2}
    # At the start none of the five has half of them; of so few some never give theirs up.
    assert np.bincount(opinion[time_s > 200])[:2].max() > 0.6 * np.count_nonzero(time_s > 200)
    # A disseminating robot's queue is full of opinions: few of its reports get in.
    assert 0 < np.mean(state == 2) < 0.4
    assert {1, 2} <= set(action) <= {0, 1, 2}


def turns(world_s: float, pause_ms: int, **grid: Any) -> tuple[NDArray[np.uint8], list[str]]:
    """The cells' lights and what happened, of modules that add up their configurations."""
    with World(
        program=HERE / "pheromone" / "ant.c",
        count=1,
        grid={
            "columns": 2,
            "rows": 2,
            "buses": 1,
            "hold_s": 0.2,
            "program": str(HERE / "turns" / "steps.c"),
            "define": [f"PAUSE_MS={pause_ms}"],
            **grid,
        },
    ) as world:
        world.run(world_s)
        return world.cells, [event["kind"] for event in world.grid_events]


def test_modules_see_each_configuration_that_a_file_has_for_them() -> None:
    cells, _ = turns(2, 0, configuration=str(HERE / "turns" / "several.kconf"))
    shown = cells[..., 1]
    # Rows from the bottom; cell 0 is the upper left one of its module, cell 1 beside it.
    assert shown[1, 0] == shown[3, 0] == 1
    assert shown[1, 2] == 0x11
    assert shown[3, 2] == 0x11 + 2 * 0x40
    assert [shown[row, 3] for row in (1, 3)] == [2, 4]


@pytest.mark.parametrize("pause_ms", [700, 3000])
def test_modules_that_pause_run_on_as_they_were_configured_once(
    pause_ms: int, tmp_path: Path
) -> None:
    (tmp_path / "empty.kconf").write_text("")
    cells, happened = turns(40, pause_ms, configuration=str(tmp_path / "empty.kconf"))
    assert happened[:3] == ["set_up", "configure", "run"]
    # It is reported once, and no module is called silent.
    assert set(happened[3:]) <= {"module_pauses"}
    assert len(happened) <= 4
    assert (cells[1::2, 1::2, 1] == 1).all()
