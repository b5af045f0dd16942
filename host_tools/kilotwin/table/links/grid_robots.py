"""Robots on a Kilogrid: reached through its modules' cells, which also forward their answers.

Modules do not read frames while they send by infrared, so nothing is sent to them before they are
done. All orders go to all modules of all buses.
"""

from collections.abc import Iterable, Sequence
from typing import Any

from kilotwin.errors import DeviceError
from kilotwin.experiment.spec.grid_layout import Layout
from kilotwin.experiment.spec.grid_plan import Settings
from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import ALL_ROBOTS, CELLS_PER_MODULE
from kilotwin.table.can import transfer
from kilotwin.table.can.address import ALL_MODULES, to_id
from kilotwin.table.can.buses import need_answers, open_all
from kilotwin.table.can.protocol import RobotReport, to_module
from kilotwin.table.can.transfer import Paced
from kilotwin.table.grid import frames as wire
from kilotwin.table.grid.can_links import CanLinks
from kilotwin.table.grid.clock import Clock, WallClock
from kilotwin.table.grid.console import carry_out, named_grid
from kilotwin.table.grid.controller import Controller, NoListener
from kilotwin.table.grid.foreign_orders import LISTEN_S, WatchedLinks, foreign_order
from kilotwin.table.grid.links import Frames, Links
from kilotwin.table.links.robot_link import Report, is_of_program
from kilotwin.units import TICK_S

# A module asks by each of its cells in turn, and puts off while it sees light.
_ASKING_S = 0.2
# From slot to slot in a boot loader; an application answers at its ticks (boot_loaders.md 5.1).
_SLOT_S = 0.015
_LATE_SLOTS = 4
"""A robot that sees light in its slot tries so many in all."""
# Modules that are told to stop end what they do: a round by all cells, a step of 70 ms.
_SETTLE_S = 0.2
_STEP_S, _FULL_S = 0.001, 1.0


class _Tap(WatchedLinks):
    """Watched buses that keep robots' answers too."""

    def __init__(self, links: Links) -> None:
        super().__init__(links)
        self.answers: list[Frames] = []

    def receive(self, now_s: float) -> Frames:
        """As Links has it."""
        frames = super().receive(now_s)
        if len(frames):
            for_host = frames["id"] & 1 == 1
            self.answers.append(frames[for_host & ~frames["from_host"]])
        return frames


class GridRobots:
    """All robots on a grid; see RobotLink.

    DeviceError if a bus does not work, or another host gives orders on it.
    """

    name = "grid"
    verifies = True
    laps_per_place = CELLS_PER_MODULE

    def __init__(
        self, layout: Layout, links: Links, clock: Clock, names: Sequence[str] = ()
    ) -> None:
        """`names` are those of the buses, for errors."""
        self._clock = clock
        self._tap = _Tap(links)
        self._names = list(names) or [f"can{bus}" for bus in range(layout.buses)]
        self._controller = Controller(layout, Settings(), self._tap, NoListener())
        self._modules = frozenset(layout.modules())
        # Answers to what was asked before are of no use.
        self._wait(LISTEN_S)

    def repeat(self, message: bytes, hold_s: float) -> None:
        """All cells repeat the message for so long, then modules are idle."""
        self._controller.send_to_robots(message, hold_s)
        carry_out(self._controller, self._clock, self._names)
        self._wait(_SETTLE_S)

    def announce(self, image: FlashImage) -> None:
        """Begins a lap. Modules say with its first page which image it is."""
        self._send(transfer.robots_announcement(image))

    def send_page(self, page: int, data: bytes) -> None:
        """The page by one cell of each module, another one in each lap."""
        self._send(transfer.robots_page(page, data))

    def ask(self, first: int, slots_log2: int, nonce: int, uid: int = ALL_ROBOTS) -> list[Report]:
        """All answers that modules heard. A robot between two cells may be heard by both."""
        self._receive()
        self._tap.answers.clear()
        signals = {"First": first, "SlotsLog2": slots_log2, "Nonce": nonce, "Uid": uid}
        self._send([Paced(to_module("ROBOT_QUERY", **signals), 0.0)])
        slot_s = TICK_S if is_of_program(first) else _SLOT_S
        self._wait(_ASKING_S + (2**slots_log2 + _LATE_SLOTS) * slot_s)
        answers, self._tap.answers = self._tap.answers, []
        found = (self._report_of(frame, first) for frames in answers for frame in frames)
        return [report for report in found if report]

    def close(self) -> None:
        """Leaves the buses, and modules as they are."""
        self._tap.close()

    def _send(self, frames: Iterable[Paced]) -> None:
        """Sends frames to all modules on all buses at the transfer's pace."""
        for frame in frames:
            for bus in range(len(self._tap)):
                self._send_one(bus, frame.data)
            self._clock.sleep(frame.pause_s)
        self._receive()

    def _send_one(self, bus: int, data: bytes) -> None:
        """A full queue is waited for; for how long, the buses know."""
        identifier = to_id(ALL_MODULES)
        began_s = self._clock.now_s()
        while not self._tap.send(bus, identifier, data, self._clock.now_s()):
            self._receive()
            if self._clock.now_s() - began_s > _FULL_S:
                raise DeviceError(
                    f"--can {self._names[bus]}: its queue stays full; see to the bus, then type "
                    "this again"
                )
            self._clock.sleep(_STEP_S)

    def _wait(self, seconds: float) -> None:
        """Lets time pass; frames are fetched now and then, so that no queue overflows."""
        end_s = self._clock.now_s() + seconds
        while (left_s := end_s - self._clock.now_s()) > 1e-9:
            self._clock.sleep(min(left_s, 0.05))
            self._receive()

    def _receive(self) -> None:
        self._tap.receive(self._clock.now_s())
        for bus, name in enumerate(self._names):
            if trouble := self._tap.trouble(bus):
                raise DeviceError(f"--can {name}: {trouble}; see to the bus, then type this again")
        if self._tap.foreign:
            raise foreign_order(self._tap, self._names, "end that program, then type this again")

    def _report_of(self, frame: Any, first: int) -> Report | None:
        match wire.read_answer(frame):
            case module, RobotReport() as said if module in self._modules:
                content = said.answer.to_bytes(4, "little")
                report = Report(said.uid, first, content, said.state, module, said.cell)
                return None if report.is_late else report
        return None


def open_grid(names: Sequence[str], size: str | None) -> GridRobots:
    """The robots on a grid by --can and --size; InputError or DeviceError if that cannot be."""
    layout, bus_names = named_grid(names, size)
    need_answers(bus_names, f"use --via dispatcher:{bus_names[0].channel}")
    buses = open_all(bus_names)
    links = CanLinks([b.bus for b in buses], echoes=[b.echoes for b in buses])
    try:
        return GridRobots(layout, links, WallClock(), [str(name) for name in bus_names])
    except BaseException:
        links.close()
        raise
