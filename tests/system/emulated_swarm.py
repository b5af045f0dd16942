"""Robots on simulated chips on an emulated grid, reached as a real one is, in simulated time."""

import contextlib
from pathlib import Path

from kilotwin import _emulator
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.engine import engine_spec
from kilotwin.experiment.spec.grid_layout import Layout
from kilotwin.experiment.text import parse_setting
from kilotwin.files.flash_image import FlashImage
from kilotwin.programs.group import build_group
from kilotwin.session.served_dispatcher import ServedDispatcher
from kilotwin.table.flash.over_the_air import SwarmFlasher
from kilotwin.table.flash.upload import Upload, Wish
from kilotwin.table.grid.clock import Clock, SimulatedClock
from kilotwin.table.grid.emulated_links import EmulatedLinks
from kilotwin.table.links.dispatcher_robots import DispatcherRobots
from kilotwin.table.links.grid_robots import GridRobots
from kilotwin.table.links.robot_link import RobotLink
from kilotwin.units import TICK_S

EXPERIMENT = """
name = "robots to flash"
duration_s = 3600

[grid]
columns = {side}
rows = {side}
buses = 1
program = "{module}"

[grid.cells]
loss = {loss}

[swarm]
profile = "kilobot"

[engine]
step_ticks = 1

[medium]
loss = {loss}
loss_at_range = {loss}

[[robots]]
program = "firmware/blank.c"
cpu = "avr"
boot_loader = true
count = {count}
"""
# Modules that do nothing by themselves.
MODULE = """
#include <module.h>
static void nothing(void) {}
int main(void) { module_init(); module_start(nothing, nothing); }
"""
# Modules are ready so long after power-up.
_BEGIN_TICKS = 60


class Quiet:
    """A display that keeps the steps with their times."""

    def __init__(self, clock: SimulatedClock) -> None:
        self._clock = clock
        self.steps: list[tuple[float, str]] = []

    def step(self, text: str) -> None:
        self.steps.append((self._clock.now_s(), text))

    def part(self, share: float) -> None:
        pass

    def note(self, text: str) -> None:
        raise AssertionError(text)


class DispatcherClock:
    """The time of a table with a dispatcher, which is served tick by tick as by `serve world`."""

    def __init__(self, simulation: _emulator.Simulation, layout: Layout) -> None:
        self._simulation = simulation
        self._dispatcher = ServedDispatcher(simulation, layout, None)
        self._now_s = simulation.tick * TICK_S
        self.port = self._dispatcher.note.rpartition(":")[2]

    def now_s(self) -> float:
        return self._now_s

    def sleep(self, seconds: float) -> None:
        self._now_s += seconds
        while self._simulation.tick < round(self._now_s / TICK_S):
            self._dispatcher.hear(self._simulation.can_frames())
            self._dispatcher.step(1)
            self._simulation.advance(1)

    def close(self) -> None:
        self._dispatcher.close()


class EmulatedSwarm:
    """`count` robots with the blank program and the boot loader; frames lost by `loss`."""

    def __init__(
        self, folder: Path, count: int, *, loss: float, side: int, settings: tuple[str, ...] = ()
    ) -> None:
        (folder / "module.c").write_text(MODULE)
        file = folder / "swarm.toml"
        module = folder / "module.c"
        file.write_text(EXPERIMENT.format(side=side, loss=loss, count=count, module=module))
        experiment = Experiment.load(file, [parse_setting(text) for text in settings])
        assert experiment.modules is not None
        assert experiment.plan is not None
        spec = engine_spec(
            experiment,
            [str(build_group(group).file) for group in experiment.groups],
            sample_ticks=2**31 - 1,
            black_box=None,
            module_guest=str(build_group(experiment.modules).file),
        )
        self.simulation = _emulator.Simulation(spec)
        self.simulation.advance(_BEGIN_TICKS)
        self.clock = SimulatedClock(self.simulation, experiment.keys.engine.step_ticks)
        self._layout = experiment.plan.layout
        links = EmulatedLinks(self.simulation, self._layout.buses)
        self.robots = GridRobots(self._layout, links, self.clock)
        self.display = Quiet(self.clock)

    def flash(self, image: FlashImage, **wish: object) -> Upload:
        """All of an upload."""
        return self._flash(image, self.robots, self.clock, wish)

    def flash_by_dispatcher(self, image: FlashImage, **wish: object) -> Upload:
        """The same, by packets to an emulated dispatcher's port. Then it waits a second."""
        clock = DispatcherClock(self.simulation, self._layout)
        with contextlib.closing(clock):
            robots = DispatcherRobots(clock.port, clock)
            with contextlib.closing(robots):
                upload = self._flash(image, robots, clock, wish)
            clock.sleep(1)
        return upload

    def colors(self) -> list[int]:
        """Colours of the robots' LEDs, as set_color() has them."""
        return [int(led) & 0x3F for led in self.simulation.snapshot()["led"][0]]

    def _flash(
        self, image: FlashImage, link: RobotLink, clock: Clock, wish: dict[str, object]
    ) -> Upload:
        upload = Upload(Wish(image, **wish), link.verifies, link.laps_per_place)  # type: ignore[arg-type]
        SwarmFlasher(upload, link, clock, self.display).run()
        return upload
