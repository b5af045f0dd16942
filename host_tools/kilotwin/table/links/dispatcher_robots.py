"""Robots on a Kilogrid with its original dispatcher, by packets on a serial line (hardware.md 3.5).

The dispatcher passes on no answer of robots, so nothing is verified here. It asks for each page of
a program when it has sent the last one; modules send a lap by one cell after the other.
"""

from kilotwin.errors import DeviceError, InputError
from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import ALL_ROBOTS, CELLS_PER_MODULE
from kilotwin.table.grid.clock import Clock, WallClock
from kilotwin.table.links.packets import (
    BIG_BAUD,
    PACKET_BYTES,
    Dispatched,
    FromDispatcher,
    GridCommand,
    Notice,
    encode,
    encode_page,
)
from kilotwin.table.links.robot_link import Report
from kilotwin.table.ports.serial_port import SerialPort

# From a packet to the next one: modules come to the end of what they send by infrared.
_SETTLE_S = 0.1
# A page takes 132 ms from request to request.
_REQUEST_S = 5.0
_POLL_S = 0.005


def parse_port(text: str) -> tuple[str, int | None]:
    """PORT or PORT@BAUD; None for a baud rate that is not given. InputError if it is none."""
    port, at, baud = text.rpartition("@")
    if not at:
        return text, None
    if not port or not baud.isdecimal() or int(baud) == 0:
        raise InputError(f"{text}: not PORT[@BAUD]; try /dev/ttyUSB0@38400")
    return port, int(baud)


class DispatcherRobots:
    """All robots on the grid of one dispatcher; see RobotLink."""

    verifies = False
    laps_per_place = CELLS_PER_MODULE

    def __init__(self, port: str, clock: Clock | None = None) -> None:
        """Opens PORT or PORT@BAUD, for us alone; DeviceError if it is not there or taken."""
        self.name = f"dispatcher:{port}"
        name, baud = parse_port(port)
        self._clock = clock or WallClock()
        self._port = SerialPort(name, baud or BIG_BAUD)
        self._stream = FromDispatcher()
        self._announced: FlashImage | None = None
        # It may be polling, or waiting for a page of an earlier program.
        self._send(encode(Dispatched.KILOGRID_COMMAND, bytes([GridCommand.IDLE])))

    def repeat(self, message: bytes, hold_s: float) -> None:
        """All cells repeat it, then modules are idle."""
        self._announced = None
        self._send(encode(Dispatched.KILO_FORWARD_IR_MSG, message))
        self._clock.sleep(hold_s)
        self._send(encode(Dispatched.KILOGRID_COMMAND, bytes([GridCommand.STOP_IR])))

    def announce(self, image: FlashImage) -> None:
        """Once for all laps: modules count them. The CRC is not passed on."""
        if self._announced == image:
            return
        self._port.read()
        self._announced = image
        self._send(encode(Dispatched.KILO_BOOTLOAD_START, bytes([len(image.pages)])))
        self._await_request()

    def send_page(self, page: int, data: bytes) -> None:
        """By the cell whose lap it is. Returns when the dispatcher asks for another one."""
        self._send(encode_page(Dispatched.KILO_BOOTPAGE, page, data))
        self._await_request()

    def ask(self, first: int, slots_log2: int, nonce: int, uid: int = ALL_ROBOTS) -> list[Report]:
        """Nothing: no answer would come through."""
        return []

    def close(self) -> None:
        """Modules are idle, and the port is free."""
        try:
            if self._announced is not None:
                self._send(encode(Dispatched.KILOGRID_COMMAND, bytes([GridCommand.STOP_IR])))
        except DeviceError:
            pass  # it is gone, and its user knows
        finally:
            self._port.close()

    def _send(self, packet: bytes) -> None:
        self._port.write(packet)
        self._clock.sleep(PACKET_BYTES * self._port.byte_s)
        if packet[1] in (Dispatched.KILOGRID_COMMAND, Dispatched.KILO_FORWARD_IR_MSG):
            self._clock.sleep(_SETTLE_S)

    def _await_request(self) -> None:
        end_s = self._clock.now_s() + _REQUEST_S
        while self._clock.now_s() < end_s:
            for packet in self._stream.take(self._port.read()):
                if isinstance(packet, Notice) and packet.type == Dispatched.KILO_BOOTLOAD_GET_PAGE:
                    return
            self._clock.sleep(_POLL_S)
        raise DeviceError(
            f"{self.name}: asks for no page; is it a dispatcher, switched on, and is its line "
            f"{round(10 / self._port.byte_s)} baud? Else name the rate: {self._port.port}@38400"
        )
