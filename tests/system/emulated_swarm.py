"""Robots on simulated chips on an emulated grid, reached as a real one is, in simulated time."""

from pathlib import Path

from kilotwin import _emulator
from kilotwin.build.group import build_group
from kilotwin.experiment.engine_spec import engine_spec
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import parse_setting
from kilotwin.files.flash_image import FlashImage
from kilotwin.flash.swarm import SwarmFlasher
from kilotwin.flash.upload import Upload, Wish
from kilotwin.grid.clock import SimulatedClock
from kilotwin.grid.emulated_links import EmulatedLinks
from kilotwin.links.grid_robots import GridRobots

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
        layout = experiment.plan.layout
        links = EmulatedLinks(self.simulation, layout.buses)
        self.robots = GridRobots(layout, links, self.clock)
        self.display = Quiet(self.clock)

    def flash(self, image: FlashImage, **wish: object) -> Upload:
        """All of an upload."""
        upload = Upload(Wish(image, **wish), True, self.robots.laps_per_place)  # type: ignore[arg-type]
        SwarmFlasher(upload, self.robots, self.clock, self.display).run()
        return upload
