"""A best-of-n experiment in the manner of labs' newer ones: ten configuration bytes, frames from
module to module, robots that never change their mind."""

from pathlib import Path

import numpy as np
import pytest

from kilotwin import World
from kilotwin.programs.port.check import check

HERE = Path(__file__).parent / "best_of_n"
OPTION = {(0, 0): 1, (1, 0): 2, (0, 1): 1, (1, 1): 2}
ROBOTS = 8


def table(cpu: str = "native", robots: str = "native", count: int = ROBOTS) -> World:
    return World(
        program=HERE / "KiloMain.c",
        count=count,
        cpu=robots,
        grid={
            "columns": 2,
            "rows": 2,
            "buses": 1,
            "hold_s": 0.2,
            "cpu": cpu,
            "program": str(HERE / "ModuleMain.c"),
            "configuration": str(HERE / "ten_bytes.kconf"),
        },
    )


@pytest.mark.parametrize("cpu", ["native", "avr"])
def test_frames_from_module_to_module_reach_whom_they_are_for(cpu: str) -> None:
    with table(cpu, count=1) as world:
        world.run(5)
        seen = world.cells[..., 1]
    # Cell n of a module shows what it has had from module n: 0-0, 1-0, 0-1, 1-1; cell 0 is the
    # upper left one, and rows count from the bottom.
    received = {
        (x, y): [int(seen[2 * y + 1 - n // 2, 2 * x + n % 2]) for n in range(4)]
        for x in (0, 1)
        for y in (0, 1)
    }
    sent = max(map(max, received.values()))
    assert 3 <= sent <= 6
    # All but the sender; 1-1 above 1-0; the row of 0-1; the column of 1-1.
    who = {0: [(1, 0), (0, 1), (1, 1)], 1: [(1, 1)], 2: [(1, 1)], 3: [(1, 0)]}
    for sender, receivers in who.items():
        for module, counts in received.items():
            expected = sent if module in receivers else 0
            assert counts[sender] == pytest.approx(expected, abs=1 if expected else 0), (
                module,
                sender,
                received,
            )


@pytest.mark.parametrize("robots", ["native", "translated"])
def test_robots_choose_and_zealots_never_change_their_mind(robots: str) -> None:
    with table(robots=robots) as world:
        world.run(60)
        zealots = [world.variable(robot, "is_zealot") == 1 for robot in range(world.size)]
        opinions = np.array(
            [world.variable(robot, "currentopinion") for robot in range(world.size)]
        )
        tiles = [world.variable(robot, "total_tiles_found") for robot in range(world.size)]
    assert sum(zealots) == ROBOTS // 4
    assert set(opinions[zealots]) == {2}
    assert set(opinions) <= {1, 2}
    assert min(tiles) > 0


def test_port_names_what_such_a_program_brings() -> None:
    report = check([str(HERE / "KiloMain.c")], [], [], None, lambda _: None)
    named = {finding.check: finding.what for finding in report.findings}
    assert "SIMULATION makes two programs of one file" in named["two-programs"]
    assert named["no-return"].startswith("the function comes to its end without a value")
    assert named["stack"].startswith("foundmodules takes 1,368 of 2,048 bytes of RAM")
