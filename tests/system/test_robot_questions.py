"""The host asks robots for their vitals through a module, and each of them answers.

A grid of one module with three robots, in every mixture of native ones and emulated processors.
"""

from collections.abc import Iterator
from pathlib import Path

import pytest

from kilotwin import _emulator
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.engine import engine_spec
from kilotwin.programs.group import build_group
from kilotwin.table.can import address, protocol

GRID = """
name = "three robots on a module"
duration_s = 60

[grid]
columns = 1
rows = 1
buses = 1
wall_cells = 0
cpu = "{modules}"

[swarm]
profile = "kilobot"
runtime = "kilotwin"

[[robots]]
program = "firmware/examples/blink.c"
cpu = "{robots}"
count = 3
poses = [[-0.025, -0.025, 0], [0.025, -0.025, 0], [0.0, 0.03, 0]]
"""
VITALS, ALL = 0xE1, 0xFFFF
IDLE, RUNNING = 0x10, 0x12
SLOTS_LOG2 = 3
ROUND_TICKS = 2**SLOTS_LOG2 + 6


class Table:
    """The engine with its one bus, and the host's part by hand."""

    def __init__(self, folder: Path, robots: str, modules: str) -> None:
        file = folder / "grid.toml"
        file.write_text(GRID.format(robots=robots, modules=modules))
        experiment = Experiment.load(file, [])
        assert experiment.modules is not None
        guests = [str(build_group(group).file) for group in experiment.groups]
        self.simulation = _emulator.Simulation(
            engine_spec(
                experiment,
                guests,
                sample_ticks=1_000_000,
                black_box=None,
                module_guest=str(build_group(experiment.modules).file),
            )
        )
        self.nonce = 0
        self.simulation.advance(60)  # the module shows its lights

    def tell(self, name: str, **signals: int) -> None:
        assert self.simulation.send_can(
            0, address.to_id(address.ALL_MODULES), protocol.to_module(name, **signals)
        )

    def heard(self) -> Iterator[protocol.RobotReport]:
        for frame in self.simulation.can_frames():
            data = bytes(frame["data"][: frame["dlc"]])
            if frame["from_host"]:
                continue
            answer = protocol.read_to_host(data)
            assert isinstance(answer, protocol.RobotReport), answer
            assert frame["id"] == address.to_id(
                address.Address(0, 0, address.AddressType.DISPATCHER)
            )
            yield answer

    def ask(self, rounds: int, uid: int = ALL) -> dict[int, protocol.RobotReport]:
        """The last answer of each robot; a module hears one frame in four, so it asks again."""
        answers = {}
        for _ in range(rounds):
            self.nonce += 1
            self.tell("ROBOT_QUERY", First=VITALS, SlotsLog2=SLOTS_LOG2, Nonce=self.nonce, Uid=uid)
            self.simulation.advance(ROUND_TICKS)
            answers.update({report.uid: report for report in self.heard()})
        return answers


@pytest.mark.parametrize("modules", ["native", "avr"])
@pytest.mark.parametrize("robots", ["native", "avr"])
def test_every_robot_tells_its_voltage_and_its_state(
    tmp_path: Path, robots: str, modules: str
) -> None:
    table = Table(tmp_path, robots, modules)
    idle = table.ask(20)
    assert len(idle) == 3
    for report in idle.values():
        assert report.state == IDLE
        assert 600 < report.answer & 0xFF | report.answer >> 30 << 8 < 1023
    one = next(iter(idle))
    assert set(table.ask(12, uid=one)) == {one}

    table.tell("MODULE_RUN")
    table.simulation.advance(60)
    assert not table.ask(4), "while the robots run they are the program's"
    table.tell("MODULE_IDLE")
    table.simulation.advance(10)
    running = table.ask(20)
    assert set(running) == set(idle)
    assert {report.state for report in running.values()} == {RUNNING}
