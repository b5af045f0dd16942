"""A Kilogrid's dispatcher as published: packets of the PC, frames for modules.

See hardware.md 3.4 and 3.5. It has no clock, no line and no buses of its own: the caller says what
came and what time it is. While an experiment runs it polls the modules one after the other, in
order of their rows; after five sweeps it says AVAILABLE and waits for the PC. A module that does
not answer holds up all of it, as with the original, whose time-out is not in use; RUN begins the
sweep anew. Of several modules that a step of the caller leaves time for, the answers are awaited
together.
"""

from collections import deque
from typing import NamedTuple

from kilotwin.table.can import transfer
from kilotwin.table.can.address import ALL_MODULES, Address, AddressType, module
from kilotwin.table.can.protocol import (
    FRAME_BYTES,
    FrameError,
    Records,
    Tracking,
    read_to_host,
    to_module,
    types_to_module,
)
from kilotwin.table.links import packets
from kilotwin.table.links.packets import Dispatched, GridCommand, Notice, Packet, Record, ToDevice
from kilotwin.units import TICK_S

Module = tuple[int, int]

SWEEPS = 5
"""So many until it asks the PC for orders."""
_POLL_S = 0.004
# Between frames of orders, while it polls and else.
_POLLING_PAUSE_S, _PAUSE_S = 0.001, 0.005
_AFTER_ORDER_S = 0.020
OLD = 0x9F
"""Types are by so much higher for old boot loaders; IDLE is said by both numbers."""


class ToModules(NamedTuple):
    """A frame for modules."""

    address: Address
    data: bytes


class EmulatedDispatcher:
    """The dispatcher's program."""

    def __init__(self) -> None:
        self._stream = ToDevice()
        self._packets: deque[Packet] = deque()
        self._orders: deque[bytes] = deque()
        self._to_modules: deque[tuple[float, ToModules]] = deque()
        self._to_pc: deque[tuple[float, bytes]] = deque()
        self._free_s = float("-inf")
        self._run_s = 0.0
        self._last: Module = (0, 0)
        self._polled: Module = (0, 0)
        self._owed: dict[Module, int] = {}
        self._sweeps = 0
        self._records: list[Record] = []
        self._trigger = 1
        self._waits = False
        self._robot_pages = self._robot_page = 0
        self._module_pages = self._module_page = 0
        self.running = False
        """Whether it polls."""
        self.lost = 0
        """Reports that its buffer had no room for."""

    def take(self, data: bytes) -> None:
        """Bytes of the PC."""
        self._packets += self._stream.take(data)

    def hear(self, sender: Module, data: bytes, now_s: float) -> None:
        """A frame of a module."""
        try:
            said = read_to_host(data)
        except FrameError:
            return
        match said:
            case Records():
                self._owe(sender, said.count, now_s)
            case Tracking():
                if len(self._records) < packets.MOST_RECORDS:
                    ticks = round((now_s - self._run_s) / TICK_S) & 0xFFFFFFFF
                    self._records.append(Record(*sender, said.cell, said.data, ticks))
                else:
                    self.lost += 1
                self._owe(sender, self._owed.get(sender, 1) - 1, now_s)

    def step(self, begin_s: float, end_s: float) -> tuple[list[tuple[float, ToModules]], bytes]:
        """Frames to modules, bytes to the PC in [begin_s, end_s), which follows on the last step.

        Frames come with their times: modules take those of a page for robots only if they come
        when the last page has gone out. All that modules sent before must have been heard.
        """
        self._free_s = max(self._free_s, begin_s)
        answered = not self._owed
        while self._free_s < end_s:
            if self._packets:
                self._obey(self._packets.popleft())
            elif self._orders and not self._owed:
                pause_s = _POLLING_PAUSE_S if self.running else _PAUSE_S
                self._send(ALL_MODULES, self._orders.popleft(), pause_s)
            elif not (self.running and answered and not self._waits and self._poll()):
                break
        frames = []
        while self._to_modules and self._to_modules[0][0] < end_s:
            frames.append(self._to_modules.popleft())
        said = b""
        while self._to_pc and self._to_pc[0][0] < end_s:
            said += self._to_pc.popleft()[1]
        return frames, said

    # The sweep.

    def _poll(self) -> bool:
        """Polls the next module; False if others have to answer first."""
        if self._polled == (0, 0) and self._sweeps >= SWEEPS:
            if self._owed:
                return False
            self._sweeps = 0
            self._waits = True
            self._say(Notice(Dispatched.DISPATCHER_AVAILABLE, 0xFF))
            return True
        x, y = self._polled
        if x < self._last[0]:
            x += 1
        else:
            x = 0
            y = 0 if y >= self._last[1] else y + 1
            self._sweeps += y == 0
        self._polled = x, y
        self._owed[self._polled] = -1
        self._send(module(x, y), to_module("TRACKING_REQ"), _POLL_S)
        return True

    def _owe(self, sender: Module, count: int, now_s: float) -> None:
        """A module owes so many reports from now on."""
        if count > 0:
            self._owed[sender] = count
            return
        self._owed.pop(sender, None)
        if self.running and len(self._records) >= self._trigger:
            self._dump(now_s)

    def _dump(self, at_s: float) -> None:
        self._to_pc.append((at_s, packets.encode_tracking(packets.Tracking(tuple(self._records)))))
        self._records = []

    # Packets of the PC.

    def _obey(self, packet: Packet) -> None:
        data = packet.data
        match packet.type:
            case Dispatched.DISPATCHER_CONTINUE:
                self._waits = False
            case Dispatched.STOP:
                self._order(to_module("FORWARD_IR_MESSAGE_STOP"))
            case Dispatched.KILO_FORWARD_IR_MSG:
                self._order(*(f.data for f in transfer.infrared(data[:9], data[9])))
            case Dispatched.KILOGRID_COMMAND:
                self._command(data)
            case Dispatched.MODULE_CONFIGURATION:
                self._configure(data)
            case Dispatched.KILO_BOOTLOAD_START:
                self._robot_pages, self._robot_page = data[0], 0
                size = to_module("KILO_BOOTPAGE_SIZE", SizePart=0, Pages=data[0])
                self._send(ALL_MODULES, size, 0.0)
                self._say(Notice(Dispatched.KILO_BOOTLOAD_GET_PAGE, 0))
                self._free_s += _AFTER_ORDER_S
            case Dispatched.KILO_BOOTPAGE:
                for frame in transfer.robots_page(data[0], data[1:]):
                    self._send(ALL_MODULES, frame.data, frame.pause_s)
                self._robot_page = (self._robot_page + 1) % max(1, self._robot_pages)
                self._say(Notice(Dispatched.KILO_BOOTLOAD_GET_PAGE, self._robot_page))
            case Dispatched.MODULE_BOOTLOAD_START:
                self._module_pages, self._module_page = data[0], 0
                size = to_module("OLD_MODULE_BOOTPAGE_SIZE", SizePart=0, Pages=data[0])
                self._send(ALL_MODULES, size, 0.0)
                self._say(Notice(Dispatched.MODULE_BOOTLOAD_GET_PAGE, 0))
            case Dispatched.MODULE_BOOTPAGE:
                for frame in transfer.modules_page(self._module_page, data[1:], old_loader=True):
                    self._send(ALL_MODULES, frame.data, frame.pause_s)
                if self._module_page < self._module_pages - 1:
                    self._module_page += 1
                    self._say(Notice(Dispatched.MODULE_BOOTLOAD_GET_PAGE, self._module_page))

    def _command(self, data: bytes) -> None:
        match data[0]:
            case GridCommand.STOP_IR:
                self._order(to_module("FORWARD_IR_MESSAGE_STOP"))
            case GridCommand.IDLE:
                idle = to_module("MODULE_IDLE")
                self._order(idle, bytes([idle[0] + OLD, *idle[1:]]))
                if self.running:
                    self.running = False
                    self._dump(self._free_s)
            case GridCommand.SETUP:
                self._order(to_module("MODULE_SETUP"))
            case GridCommand.RUN:
                self._order(to_module("MODULE_RUN"))
                self._begin(data[1], data[2], data[3])
            case GridCommand.BOOTLOAD:
                self._order(to_module("MODULE_BOOT"))
            case _:
                # PAUSE among them: there is no such order, but a frame of zeros goes out.
                self._order(bytes([types_to_module()["MODULE_USER"]]).ljust(FRAME_BYTES, b"\0"))

    def _begin(self, columns: int, rows: int, trigger: int) -> None:
        self.running = True
        self._run_s = self._free_s
        self._owed.clear()
        self._records = []
        self._last = self._polled = (max(1, columns) - 1, max(1, rows) - 1)
        self._trigger = trigger

    def _configure(self, data: bytes) -> None:
        x, y, kind, size = data[:4]
        if kind not in tuple(AddressType) or not 0 < size <= transfer.CONFIG_BYTES:
            return
        address = Address(x, y, AddressType(kind))
        for frame in transfer.configuration(data[4 : 4 + size]):
            self._send(address, frame.data, frame.pause_s)
        self._free_s += _AFTER_ORDER_S

    def _order(self, *frames: bytes) -> None:
        """Frames for all modules, when those that are polled have answered."""
        self._orders += frames
        self._waits = False

    def _send(self, address: Address, data: bytes, pause_s: float) -> None:
        self._to_modules.append((self._free_s, ToModules(address, data)))
        self._free_s += pause_s

    def _say(self, notice: Notice) -> None:
        self._to_pc.append((self._free_s, packets.encode_notice(notice)))
