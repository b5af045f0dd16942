"""Programs for the ARGoS simulator's Kilobots run as they are, on the chip's code and natively."""

import shutil
from pathlib import Path

import pytest

from kilotwin import World
from kilotwin.errors import InputError

ARGOS = Path(__file__).parent / "argos"
UPDATE_TIME = Path(__file__).resolve().parents[2] / "experiments/kilogrid/update-time"
CPUS = ["native", "translated"]
RUN_S = 90


@pytest.mark.parametrize("cpu", CPUS)
def test_a_behaviour_runs_on_the_table_of_the_update_time(cpu: str, tmp_path: Path) -> None:
    text = (UPDATE_TIME / "update-time.toml").read_text()
    text = text.partition("[metric.black]")[0]  # they are of variables of its own program
    text = text.replace('"robot.c"', f'"{ARGOS / "gatherer.c"}"')
    text = text.replace('"cell.c"', f'"{UPDATE_TIME / "cell.c"}"')
    (tmp_path / "table.toml").write_text(text)
    with World(tmp_path / "table.toml", set=[f"swarm.cpu={cpu}"]) as world:
        world.run(RUN_S)
        staying = [world.variable(robot, "broadcast") == 1 for robot in range(world.size)]
        colours = [world.variable(robot, "ground_color") for robot in range(world.size)]
    # Each robot knows its cell, and some have found a stripe by then.
    assert set(colours) <= {20, 21, 22}
    assert 5 <= sum(staying) < len(staying)


@pytest.mark.parametrize("cpu", CPUS)
@pytest.mark.parametrize(
    "written",
    [
        "debug_info_create(debug_info_t);",
        "debug_info_create(); debug_info_set(com_robot, RGB(1, 2, 3)); debug_info_destroy();",
    ],
)
def test_debug_info_vanishes_however_it_is_written(written: str, cpu: str, tmp_path: Path) -> None:
    for file in ARGOS.iterdir():
        shutil.copy(file, tmp_path)
    program = tmp_path / "gatherer.c"
    program.write_text(program.read_text().replace("debug_info_create();", written))
    with World(program=program, count=2, cpu=cpu) as world:
        world.run(1)
        assert world.variable(0, "timer") >= 32 * 5


@pytest.mark.parametrize("cpu", CPUS)
@pytest.mark.parametrize(
    ("header", "told"),
    [
        ("agent.h", r"there is no agent\.h \(an ARGoS project keeps it beside its behaviours\)"),
        ("distribution_functions.c", r"there is no distribution_functions\.c: put it beside the"),
    ],
)
def test_a_header_that_is_missing_is_named_with_what_to_do(
    header: str, told: str, cpu: str, tmp_path: Path
) -> None:
    for file in ARGOS.iterdir():
        if file.name != header:
            shutil.copy(file, tmp_path)
    with pytest.raises(InputError, match=told):
        World(program=tmp_path / "gatherer.c", count=2, cpu=cpu)


def test_a_header_of_the_simulator_itself_is_told_apart(tmp_path: Path) -> None:
    (tmp_path / "loop.c").write_text("#include <argos3/core/simulator/simulator.h>\n")
    with pytest.raises(InputError, match=r"simulator\.h is a simulator's own, in C\+\+: leave out"):
        World(program=tmp_path / "loop.c", count=2, cpu="native")
