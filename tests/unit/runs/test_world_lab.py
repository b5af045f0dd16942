"""Robots of a lab: what its file says is in their EEPROM, natively and on chips."""

from pathlib import Path

import pytest

from kilotwin import World
from kilotwin.experiment.spec.overhead import calib, readuid

LAB = """
[robot.12]
turn_left = 81
[robot.3]
turn_left = 61
"""


@pytest.mark.parametrize("cpu", ["native", "avr"])
def test_uids_and_duties_are_the_labs(tmp_path: Path, cpu: str) -> None:
    file = tmp_path / "lab.toml"
    file.write_text(LAB)
    with World(
        program="firmware/blank.c",
        poses=[[0, 0, 0], [0.3, 0, 0]],
        cpu=cpu,
        swarm={"lab": str(file), "runtime": "kilotwin"},  # which obeys what is marked for one robot
        command=[],
    ) as world:
        world.run(1)
        message = calib("straight", 12, (0, 0, 71, 72), only=True)
        world.send(message[:9], message[9])
        world.run(1)
        assert world.motors.tolist() == [[0, 0], [71, 72]]
        message = readuid(0)  # 3 has bit 0, 12 has not
        world.send(message[:9], message[9])
        world.run(1)
        assert world.motors.tolist() == [[61, 0], [0, 0]]
        message = readuid(3)
        world.send(message[:9], message[9])
        world.run(1)
        assert world.motors.tolist() == [[0, 0], [81, 0]]
        world.send(robot=0, type=0x85)
        world.send(robot=1, type=0x85)
        world.run(1)
        assert world.motors.tolist() == [[0, 0], [0, 0]]
