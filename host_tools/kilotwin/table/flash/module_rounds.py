"""Frames for the boot loaders of a grid's modules: whom they are for, by bus, and at which pace."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from kilotwin.experiment.spec.grid_layout import Layout, Module
from kilotwin.files.flash_image import FlashImage
from kilotwin.table.can import transfer
from kilotwin.table.can.protocol import to_module
from kilotwin.table.can.transfer import Paced
from kilotwin.table.grid.controller import Sending
from kilotwin.table.grid.cover import ALL_MODULES, Group

CHECK_S = 0.5
"""In less a loader reads the program that it has, which is a page in 1 ms."""
ORDER_PAUSE_S = 0.002
"""From an order for one module to the next."""
# A program leaves for its boot loader in less.
_ENTRY_S = 0.3


@dataclass(frozen=True)
class Round:
    """Frames to send, by bus, each at its pace; then the time that modules need."""

    text: str
    frames: Mapping[int, Sequence[Sending]]
    settle_s: float

    @property
    def duration_s(self) -> float:
        """How long it takes."""
        pauses = (sum(frame.pause_s for _, frame in sent) for sent in self.frames.values())
        return max(pauses, default=0.0) + self.settle_s


def to_modules(
    text: str, layout: Layout, frames: Mapping[Module, Sequence[Paced]], settle_s: float
) -> Round:
    """Frames for single modules, in turns, so that each module has time for its own."""
    by_bus: dict[int, list[Sending]] = {}
    for number in range(max(map(len, frames.values()), default=0)):
        for module, own in frames.items():
            if number < len(own):
                by_bus.setdefault(layout.bus_of(module), []).append((Group(*module), own[number]))
    return Round(text, by_bus, settle_s)


def call(text: str, layout: Layout, modules: Collection[Module]) -> Round:
    """Modules are told to leave their programs for their boot loaders."""
    boot = Paced(to_module("MODULE_BOOT"), ORDER_PAUSE_S)
    return to_modules(text, layout, {module: [boot] for module in modules}, _ENTRY_S)


def old_lap(
    image: FlashImage, layout: Layout, wanted: Collection[Module], spared: Collection[Module]
) -> Round:
    """A program for original boot loaders, which cannot be asked: all of it, once, as published."""
    frames: dict[int, list[Sending]] = {}
    for bus in range(layout.buses):
        here = [module for module in layout.modules_of(bus) if module in wanted]
        for group in groups(here, spared, layout.modules_of(bus)):
            program = transfer.module_program(image.padded, old_loader=True)
            frames.setdefault(bus, []).extend((group, frame) for frame in program)
    return Round(f"sending {len(image.pages)} pages to original boot loaders", frames, CHECK_S)


def groups(
    wanted: Collection[Module], spared: Collection[Module], of_bus: Sequence[Module]
) -> list[Group]:
    """The fewest addresses on a bus that reach all these modules and none that is spared."""
    if not wanted:
        return []
    if not any(module in spared for module in of_bus):
        return [ALL_MODULES]
    found = []
    for y in dict.fromkeys(y for _, y in of_bus):
        row = [module for module in wanted if module[1] == y]
        if row and not any(module in spared for module in of_bus if module[1] == y):
            found.append(Group(None, y))
        else:
            found += [Group(*module) for module in row]
    return found
