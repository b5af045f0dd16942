"""A Kilogrid's dispatcher as an interface of python-can: `--can kilogrid:/dev/ttyUSB0`.

One bus for the whole grid, whatever buses the dispatcher has. Frames to modules become packets, as
far as the dispatcher has one for them: what orders all modules, infrared messages, configurations,
programs. All else is dropped (questions for health, orders to single modules). It polls by itself
while an experiment runs, so TRACKING_REQ is answered here, from the reports that it has passed on.
Which modules there are it never says: each one that is asked for seems to be there.

While it polls it takes packets when it says AVAILABLE. Until a packet has gone, send() raises
CanOperationError with ENOBUFS: the next frame has to be sent again later.
"""

import errno
import time
from collections import deque
from typing import Any

import can

from kilotwin.errors import DeviceError
from kilotwin.table.can.address import Address, AddressType, from_id, to_id
from kilotwin.table.can.protocol import types_to_module
from kilotwin.table.can.transfer import CHUNK_BYTES, CONFIG_BYTES
from kilotwin.table.grid import frames as wire
from kilotwin.table.links import packets
from kilotwin.table.links.dispatcher_robots import parse_port
from kilotwin.table.links.packets import Dispatched, FromDispatcher, GridCommand, Notice, encode
from kilotwin.table.ports.serial_port import SerialPort

# As many as KiloGUI asks for on a small grid: reports are not held back for long.
_RECORDS_PER_PACKET = 10
# Between packets: the dispatcher has one buffer, and carries the last one out meanwhile.
_PAUSE_S, _CONFIGURATION_PAUSE_S = 0.03, 0.1
# It is AVAILABLE until CONTINUE, which is held back for more packets that may follow a
# configuration.
_LINGER_S = 0.05
_SILENT_S = 0.5
# It has not become AVAILABLE for so long: a module does not answer, and holds it up.
_STUCK_S = 10.0
_POLL_S = 0.001
_PAGE_CHUNKS = 22
_COMMANDS = {
    "FORWARD_IR_MESSAGE_STOP": GridCommand.STOP_IR,
    "MODULE_IDLE": GridCommand.IDLE,
    "MODULE_SETUP": GridCommand.SETUP,
    "MODULE_BOOT": GridCommand.BOOTLOAD,
}
_BOOTLOAD = {
    "KILO_BOOTPAGE_SIZE": Dispatched.KILO_BOOTLOAD_START,
    "MODULE_BOOTPAGE_SIZE": Dispatched.MODULE_BOOTLOAD_START,
}


class KilogridBus(can.BusABC):
    """A dispatcher. `channel`: PORT or PORT@BAUD; `size`: columns and rows of the grid."""

    full_s = 60.0
    """For how long its queue may be full before the bus counts as down."""

    def __init__(
        self,
        channel: str,
        can_filters: Any = None,
        *,
        size: tuple[int, int] = (10, 20),
        **more: Any,
    ) -> None:
        """DeviceError, as of any port, if it is not there or taken. `more` is not used."""
        name, baud = parse_port(channel)
        small = size[0] * size[1] <= packets.SMALL_MODULES
        self._port = SerialPort(name, baud or (packets.SMALL_BAUD if small else packets.BIG_BAUD))
        self._size = size
        self._stream = FromDispatcher()
        self._types = {number: kind for kind, number in types_to_module().items()}
        self._received: deque[can.Message] = deque()
        self._records: dict[tuple[int, int], deque[packets.Record]] = {}
        # The packet to be sent next, and the request that it answers, if it has to; never a second.
        self._waiting: list[tuple[bytes, int | None]] = []
        self._ready_s = self._heard_s = self._spoke_s = time.monotonic()
        self._available = False
        self._requested: Notice | None = None
        self._infrared = b""
        self._configuration: dict[int, tuple[int, bytes]] = {}
        self._page, self._chunks = 0, b""
        self._gone: DeviceError | None = None
        self.running = False
        """Whether the dispatcher polls, as far as is known here."""
        self.dropped = 0
        """Frames that it has no packet for."""
        self.channel_info = f"dispatcher at {channel}"
        super().__init__(channel=channel, can_filters=can_filters)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Takes a frame to modules. CanOperationError if the port is gone or the queue full."""
        self._pump()
        data = bytes(msg.data)
        kind = self._types.get(data[0]) if data else None
        address = from_id(msg.arbitration_id)
        if kind == "TRACKING_REQ":
            self._answer((address.x, address.y))
            return
        if self._waiting:
            what = "the dispatcher has not taken the last packet yet"
            raise can.CanOperationError(what, error_code=errno.ENOBUFS)
        if not self._take(kind, address, data):
            self.dropped += 1
        self._pump()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        end_s = None if timeout is None else time.monotonic() + timeout
        while True:
            self._pump()
            if self._received:
                return self._received.popleft(), False
            if end_s is not None and time.monotonic() >= end_s:
                return None, False
            time.sleep(_POLL_S)

    def shutdown(self) -> None:
        """Waits for the last packet to go, and releases the port."""
        if self._is_shutdown:
            return
        super().shutdown()
        end_s = time.monotonic() + _STUCK_S + 1
        while self._waiting and self._gone is None and time.monotonic() < end_s:
            self._pump(raises=False)
            time.sleep(_POLL_S)
        self._port.close()

    # Frames to modules.

    def _take(self, kind: str | None, address: Address, data: bytes) -> bool:
        """Whether the dispatcher can pass it on, or it is a part of something that it can."""
        payload = data[2:].ljust(CHUNK_BYTES, b"\0")
        if kind == "MODULE_CONFIG_SIZE":
            self._configuration[to_id(address)] = data[2], b""
            return True
        if kind == "MODULE_CONFIG_TRANSFER":
            return self._configure(address, data[1], payload)
        if address.type != AddressType.BROADCAST or kind is None:
            return False
        if kind == "FORWARD_IR_MESSAGE":
            return self._forward(data[1], payload)
        if kind in _COMMANDS:
            command = _COMMANDS[kind]
            # It leaves modules in the same state, and ends the polling, too.
            if command == GridCommand.STOP_IR and self.running:
                command = GridCommand.IDLE
            self._queue(Dispatched.KILOGRID_COMMAND, bytes([command]))
            return True
        if kind == "MODULE_RUN":
            self._queue(Dispatched.KILOGRID_COMMAND, self._run_command())
            return True
        return self._take_program(kind.removeprefix("OLD_"), data[1], payload)

    def _forward(self, part: int, payload: bytes) -> bool:
        if part == 0:
            self._infrared = payload
        elif self._infrared:
            self._queue(Dispatched.KILO_FORWARD_IR_MSG, self._infrared + payload[:4])
            self._infrared = b""
        else:
            return False
        return True

    def _take_program(self, kind: str, number: int, payload: bytes) -> bool:
        """A frame of a program for robots or modules."""
        match kind:
            # Part 1 of ours, CRC and id, has no packet.
            case "KILO_BOOTPAGE_SIZE" | "MODULE_BOOTPAGE_SIZE" if number == 0:
                self._queue(_BOOTLOAD[kind], payload[:1])
            case "KILO_BOOTPAGE_NUMBER" | "MODULE_BOOTPAGE_NUMBER":
                self._page, self._chunks = payload[0], b""
            case "KILO_BOOTPAGE" | "MODULE_BOOTPAGE":
                self._add_chunk(kind, payload)
            case _:
                return False
        return True

    def _run_command(self) -> bytes:
        return bytes([GridCommand.RUN, *self._size, _RECORDS_PER_PACKET])

    def _queue(self, kind: int, data: bytes, request: int | None = None) -> None:
        if kind in (Dispatched.KILO_BOOTLOAD_START, Dispatched.MODULE_BOOTLOAD_START):
            self._requested = None
        self._waiting = [(encode(kind, data), request)]
        self._spoke_s = max(self._spoke_s, time.monotonic())

    def _configure(self, address: Address, number: int, payload: bytes) -> bool:
        size, content = self._configuration.get(to_id(address), (0, b""))
        if number * CHUNK_BYTES != len(content) or not 0 < size <= CONFIG_BYTES:
            return False
        content += payload
        if len(content) < size:
            self._configuration[to_id(address)] = size, content
            return True
        del self._configuration[to_id(address)]
        head = bytes([address.x, address.y, address.type, size])
        self._queue(Dispatched.MODULE_CONFIGURATION, head + content[:size])
        return True

    def _add_chunk(self, kind: str, payload: bytes) -> None:
        """When a page is whole it answers the dispatcher's request for one."""
        self._chunks += payload
        if len(self._chunks) < _PAGE_CHUNKS * CHUNK_BYTES:
            return
        content = bytes([self._page]) + self._chunks[: packets.DATA_BYTES - 1]
        self._chunks = b""
        if kind == "KILO_BOOTPAGE":
            self._queue(Dispatched.KILO_BOOTPAGE, content, Dispatched.KILO_BOOTLOAD_GET_PAGE)
        else:
            self._queue(Dispatched.MODULE_BOOTPAGE, content, Dispatched.MODULE_BOOTLOAD_GET_PAGE)

    # The line.

    def _pump(self, *, raises: bool = True) -> None:
        """Reads what has come, and sends what may go."""
        try:
            if self._gone is None:
                self._read()
                self._write()
        except DeviceError as error:
            self._gone = error
        if self._gone is not None and raises:
            raise can.CanOperationError(str(self._gone))

    def _read(self) -> None:
        now_s = time.monotonic()
        data = self._port.read()
        if data:
            self._heard_s = now_s
        found = self._stream.take(data)
        if not data and now_s - self._heard_s > _SILENT_S:
            found = self._stream.take_rest()
        for packet in found:
            if isinstance(packet, packets.Tracking):
                for record in packet.records:
                    self._records.setdefault((record.x, record.y), deque()).append(record)
                if not self.running:
                    self._answer_all()
            elif packet.type == Dispatched.DISPATCHER_AVAILABLE:
                self.running = self._available = True
                self._spoke_s = now_s
            else:
                self._requested = packet

    def _write(self) -> None:
        now_s = time.monotonic()
        if not self._waiting:
            if self._available and now_s >= self._ready_s and now_s - self._spoke_s > _LINGER_S:
                self._port.write(packets.CONTINUE)
                self._available = False
                self._spoke_s = now_s
            return
        packet, request = self._waiting[0]
        if now_s < self._ready_s or not self._may_send(request, now_s):
            return
        self._port.write(packet)
        self._waiting.clear()
        self._spoke_s = now_s
        configures = packet[1] == Dispatched.MODULE_CONFIGURATION
        line_s = len(packet) * self._port.byte_s
        self._ready_s = now_s + line_s + (_CONFIGURATION_PAUSE_S if configures else _PAUSE_S)
        if request is not None:
            self._requested = None
        if not configures:
            self._available = False
        if packet[1] == Dispatched.KILOGRID_COMMAND:
            self.running = packet[2] == GridCommand.RUN or (
                self.running and packet[2] != GridCommand.IDLE
            )

    def _may_send(self, request: int | None, now_s: float) -> bool:
        if request is not None:
            return self._requested is not None and self._requested.type == request
        if not self.running or self._available:
            return True
        if now_s - self._spoke_s > _STUCK_S:
            # RUN has it begin its sweep anew; until the sweep is held up again it takes orders.
            self._port.write(encode(Dispatched.KILOGRID_COMMAND, self._run_command()))
            return True
        return False

    # Reports.

    def _answer(self, asked: tuple[int, int]) -> None:
        """A poll, from what the dispatcher has passed on of that module."""
        records = self._records.pop(asked, deque())
        fixed, identifier = wire.fixed(), wire.id_from_module(asked)
        # An answer announces so many at most; the others wait for the next poll.
        now = [records.popleft() for _ in range(min(len(records), fixed.MOST_RECORDS))]
        if records:
            self._records[asked] = records
        self._say(identifier, bytes([fixed.START, len(now)]))
        for record in now:
            kind = fixed.TRACKING | record.cell << fixed.CELL_SHIFT
            self._say(identifier, bytes([kind]) + record.data)

    def _answer_all(self) -> None:
        """The last reports come when the run is over, and it is not polled any more."""
        while self._records:
            self._answer(next(iter(self._records)))

    def _say(self, identifier: int, data: bytes) -> None:
        self._received.append(
            can.Message(
                timestamp=time.time(),
                arbitration_id=identifier,
                data=data,
                is_extended_id=False,
                channel=str(self.channel_info),
            )
        )
