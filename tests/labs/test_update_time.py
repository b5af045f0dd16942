"""experiments/kilogrid/update-time: the table says where a robot is, and its clock what it does."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kilotwin import World
from kilotwin.studies.sweep.plan import read_plan
from kilotwin.units import TICK_S

FOLDER = Path(__file__).resolve().parents[2] / "experiments/kilogrid/update-time"
CELL_M, SIDE = 0.05, 20
MINUTE_TICKS, MORE_TICKS, FIRST_TICKS = 1920, 4, 32


def kind_of(column: int, row: int) -> str:
    """Kind of a cell by the published layout: a band two wide, and stripes of 3 x 16 within."""
    if min(column, row) < 2 or max(column, row) >= SIDE - 2:
        return "wall"
    if column < 5:
        return "black"
    return "white" if column >= SIDE - 5 else "grey"


def centre_m(cell: int) -> float:
    return (cell + 0.5) * CELL_M - 0.5


def alone(tmp_path: Path, medium: str = "kilobot", **robots: Any) -> World:
    """One robot in a disc without cells."""
    words = {"program": str(FOLDER / "robot.c"), "count": 1, "poses": [[0.0, 0.0, 0.0]], **robots}
    rows = "\n".join(f"{key} = {value!r}" for key, value in words.items())
    (tmp_path / "alone.toml").write_text(
        f'name = "alone"\nduration_s = 18000\n[arena]\ndiameter_m = 10\n'
        f'[swarm]\nprofile = "kilobot"\n[medium]\nkind = "{medium}"\n[[robots]]\n{rows}\n'
    )
    return World(tmp_path / "alone.toml", seed=1)


@pytest.mark.parametrize("file", ["update-time.toml", "their-table.toml"])
def test_a_robot_in_the_middle_of_a_cell_knows_what_the_published_table_has_there(
    file: str, tmp_path: Path
) -> None:
    cells = [(c, r) for c in (1, 2, 4, 5, 9, 14, 15, 17, 18) for r in (1, 2, 10, 17, 18)]
    text = (FOLDER / file).read_text().replace('"robot.c"', f'"{FOLDER / "robot.c"}"')
    text = text.replace('"cell.c"', f'"{FOLDER / "cell.c"}"')
    poses = [[centre_m(column), centre_m(row), 0.0] for column, row in cells]
    text = text.replace("count = 34", f"count = {len(cells)}\nposes = {poses}", 1)
    (tmp_path / "table.toml").write_text(text.replace("count = 16", "count = 0", 1))
    known = {"black": "on_black", "white": "on_white", "wall": "on_wall"}
    with World(tmp_path / "table.toml", seed=1) as world:
        # Two words of each cell; robots have gone 1 cm, and are out of the range of others.
        world.run(1.05)
        for robot, (column, row) in enumerate(cells):
            seen = {kind for kind, name in known.items() if world.variable(robot, name)}
            assert seen == {kind_of(column, row)} - {"grey"}, (column, row)


@pytest.mark.parametrize(
    ("cpu", "define", "least", "most"),
    [
        ("native", [], 8, 8),
        ("native", ["GUARDED=1"], 8, 8),
        ("translated", ["GUARDED=1"], 8, 8),
        ("translated", [], 64, 1e9),
    ],
    ids=["native", "native, guarded", "translated, guarded", "translated"],
)
def test_a_minute_without_a_guard_counts_passes_where_code_takes_time(
    cpu: str, define: list[str], least: float, most: float, tmp_path: Path
) -> None:
    with alone(tmp_path, cpu=cpu, define=["UPDATE_S=0", *define]) as world:
        world.run(130)
        more = world.variable(0, "update_ticks") - FIRST_TICKS
        assert least <= more <= most


def test_a_step_of_3_1_ticks_meets_a_minute_one_time_in_three(tmp_path: Path) -> None:
    define = ["UPDATE_S=0", "STEP_TENTHS=31"]
    with alone(tmp_path, "ideal", cpu="native", define=define) as world:
        world.run(18000)
        met = (world.variable(0, "update_ticks") - FIRST_TICKS) / MORE_TICKS
    steps = np.arange(0, 18000 / TICK_S * 10, 31)
    # Each step acts in the first tick that is not before it.
    expected = np.count_nonzero(np.ceil(steps / 10) % MINUTE_TICKS == 0)
    assert met == pytest.approx(expected, abs=2)
    assert 85 < met < 100


def test_a_kind_of_which_a_condition_has_none_is_left_out_and_the_others_go_on(
    tmp_path: Path,
) -> None:
    (tmp_path / "kinds.toml").write_text(f"""\
name = "kinds"
duration_s = 10
[arena]
diameter_m = 1
[swarm]
profile = "kilobot"
{
        "".join(
            f'''[[robots]]
program = "{FOLDER / "robot.c"}"
count = {count}
define = ["WEIGHT={count}"]
'''
            for count in (2, 0, 3)
        )
    }""")
    with World(tmp_path / "kinds.toml", seed=1) as world:
        world.run(1)
        assert len(world.poses) == 5


@pytest.mark.parametrize(
    ("cpu", "define", "stay"),
    [
        ("native", [], False),
        ("translated", [], True),
        ("avr", [], True),
        ("translated", ["GUARDED=1"], False),
    ],
)
def test_the_minute_shows_in_who_stays_on_each_machine(
    cpu: str, define: list[str], stay: bool
) -> None:
    words = ["UPDATE_S=0", "FLOOR=1", *define]
    text = ",".join(f'"{word}"' for word in words)
    with World(
        FOLDER / "alone.toml", seed=1, set=[f"swarm.cpu={cpu}", f"robots.0.define=[{text}]"]
    ) as world:
        staying = 0
        for _ in range(5):
            world.run(40)
            staying += world.states.count("staying")
    # Five looks at two robots, of which the first comes before the minute.
    assert (staying >= 5) == stay


@pytest.mark.parametrize("sweep", ["draws.toml", "minute.toml"])
def test_the_sweeps_of_the_walkthrough_have_runs_enough_for_a_verdict(sweep: str) -> None:
    trials = read_plan(FOLDER / sweep).trials
    seeds = {trial.seed for trial in trials}
    assert len(seeds) >= 5  # compare decides nothing with fewer
    assert len(trials) % len(seeds) == 0
