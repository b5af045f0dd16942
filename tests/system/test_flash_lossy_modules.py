"""Modules on simulated chips are flashed over a bus that loses frames, in simulated time."""

import random
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from kilotwin import _emulator
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.programs import find_program
from kilotwin.experiment.spec.engine import engine_spec
from kilotwin.experiment.spec.grid_layout import Layout, Module
from kilotwin.programs.group import build_group
from kilotwin.programs.image.image import build_image
from kilotwin.table.can.address import AddressType, from_id, module, to_id
from kilotwin.table.flash.image import modules_image
from kilotwin.table.flash.modules import Job, ModulesFlasher
from kilotwin.table.flash.modules_table import Inbox, ModulesTable
from kilotwin.table.grid.clock import SimulatedClock
from kilotwin.table.grid.emulated_links import EmulatedLinks
from kilotwin.table.grid.links import Frames

from .conftest import ROOT

EXPERIMENT = """
name = "chips to flash"
duration_s = 600

[grid]
columns = 2
rows = 2
buses = 1
cpu = "avr"
boot_loader = true

[engine]
step_ticks = 1

[swarm]
profile = "kilobot"

[[robots]]
program = "firmware/blank.c"
count = 1
"""
LOSS = 0.01


class LossyLinks(EmulatedLinks):
    """Loses a share of the frames to each module by itself, and of its answers."""

    def __init__(self, simulation: _emulator.Simulation, layout: Layout, inbox: Inbox) -> None:
        super().__init__(simulation, layout.buses)
        self._modules = list(layout.modules())
        self._inbox = inbox
        self._random = random.Random(1)
        self.lost = 0

    def send(self, bus: int, identifier: int, data: bytes, now_s: float) -> bool:
        """One that some of its modules miss goes to the others one by one."""
        wanted = self._receivers(identifier)
        reached = [place for place in wanted if not self._is_lost()]
        if reached == wanted:
            return super().send(bus, identifier, data, now_s)
        sent = [super(LossyLinks, self).send(bus, to_id(module(*p)), data, now_s) for p in reached]
        assert all(sent)
        return True

    def send_all(self, bus: int, identifiers: Sequence[int], data: bytes, now_s: float) -> int:
        return sum(self.send(bus, identifier, data, now_s) for identifier in identifiers)

    def receive(self, now_s: float) -> Frames:
        frames = super().receive(now_s)
        kept: Frames = frames[np.array([not self._is_lost() for _ in frames], dtype=bool)]
        self._inbox.add(kept)
        return kept

    def _receivers(self, identifier: int) -> list[Module]:
        to = from_id(identifier)
        by_column = to.type in (AddressType.COLUMN, AddressType.INDIVIDUAL)
        by_row = to.type in (AddressType.ROW, AddressType.INDIVIDUAL)
        return [
            (x, y)
            for x, y in self._modules
            if (x == to.x or not by_column) and (y == to.y or not by_row)
        ]

    def _is_lost(self) -> bool:
        lost = self._random.random() < LOSS
        self.lost += lost
        return lost


class Silent:
    """A display that shows nothing."""

    def step(self, text: str) -> None:
        pass

    def part(self, share: float) -> None:
        pass

    def note(self, text: str) -> None:
        raise AssertionError(text)


def test_chips_that_miss_frames_are_verified_and_run(tmp_path: Path) -> None:
    (tmp_path / "grid.toml").write_text(EXPERIMENT)
    experiment = Experiment.load(tmp_path / "grid.toml")
    assert experiment.plan is not None
    assert experiment.modules is not None
    spec = engine_spec(
        experiment,
        [str(build_group(group).file) for group in experiment.groups],
        sample_ticks=2**31 - 1,
        black_box=None,
        module_guest=str(build_group(experiment.modules).file),
    )
    simulation = _emulator.Simulation(spec)
    simulation.advance(60)
    clock = SimulatedClock(simulation, experiment.keys.engine.step_ticks)
    layout = experiment.plan.layout
    links = LossyLinks(simulation, layout, inbox := Inbox())
    display = Silent()
    table = ModulesTable(layout, links, inbox, ["can0"], clock=clock, note=display.note)
    program = find_program("cell_module.c", ROOT / "tests/system/programs", api="module")
    image = modules_image(build_image(program).hex)
    outcome = ModulesFlasher(Job(image, "cell_module.c"), table, display).flash()
    print(f"{links.lost} frames lost, {outcome.laps} laps of {len(image.pages)} pages")
    assert outcome.well, outcome.text()
    assert len(outcome.modules) == 4
    assert links.lost > 10
    assert 1 < outcome.laps <= 4
