"""A grid whose modules are to be flashed: its buses, a clock, and what loaders report."""

from collections.abc import Callable, Sequence
from typing import Any

from kilotwin.experiment.spec.grid_layout import Layout, Module
from kilotwin.experiment.spec.grid_plan import Settings
from kilotwin.table.can.protocol import BootReport, types_to_host, types_to_module
from kilotwin.table.grid import frames as wire
from kilotwin.table.grid.clock import Clock
from kilotwin.table.grid.controller import Controller
from kilotwin.table.grid.links import Frames, Links
from kilotwin.table.grid.poller import Reports

_STEP_S = 0.001


class Inbox:
    """Keeps what loaders report, and notices another host that sends programs."""

    def __init__(self) -> None:
        self.reports: list[tuple[Module, BootReport]] = []
        self.stranger = False
        self._report = types_to_host()["MODULE_BOOT_REPORT"]
        self._programs = [n for name, n in types_to_module().items() if "MODULE_BOOTPAGE" in name]

    def add(self, frames: Frames) -> None:
        """Frames in order of time, of any bus."""
        kinds = frames["data"][:, 0]
        to_host = frames["id"] & 1 == 1
        for kind in self._programs:
            self.stranger |= bool((~to_host & ~frames["from_host"] & (kinds == kind)).any())
        reports = to_host & (kinds & wire.fixed().TYPE_MASK == self._report)
        for frame in frames[reports]:
            match wire.read_answer(frame):
                case module, BootReport() as report:
                    self.reports.append((module, report))


class ModulesTable:
    """One controller with its buses and its clock."""

    def __init__(
        self,
        layout: Layout,
        links: Links,
        inbox: Inbox,
        names: Sequence[str],
        *,
        clock: Clock,
        note: Callable[[str], None],
    ) -> None:
        """The buses hand all frames to the inbox; `names` are theirs."""
        self.layout = layout
        self.inbox = inbox
        self._names, self._clock, self._note = names, clock, note
        self.controller = Controller(layout, Settings(), links, self)
        self.controller.step(clock.now_s())

    def wait(self, ended: Callable[[], bool]) -> None:
        """Carries the order out: until it is done, no bus works any more, or `ended`."""
        controller = self.controller
        controller.step(self._clock.now_s())
        while controller.busy and len(controller.down) < len(self._names) and not ended():
            self._clock.sleep(_STEP_S)
            controller.step(self._clock.now_s())

    def down_text(self) -> str:
        """The buses that do not work, and why; empty if all do."""
        down = self.controller.down.items()
        return "; ".join(f"{self._names[bus]}: {why}" for bus, why in down)

    def reports(self, reports: Reports) -> None:
        """Reports of robots are not shown."""

    def event(self, now_s: float, kind: str, text: str, **more: Any) -> None:
        """Tells that a bus went down or works again; modules come and go while flashed."""
        if kind.startswith("bus"):
            self._note(text)
