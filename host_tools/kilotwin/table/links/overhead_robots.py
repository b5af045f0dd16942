"""Robots below an overhead controller: packets on a serial line, 38400 baud (hardware.md 1.11).

An overhead controller never hears robots: its receiver is off. So nothing is verified here.
"""

from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import ALL_ROBOTS
from kilotwin.table.grid.clock import Clock, WallClock
from kilotwin.table.links import messages
from kilotwin.table.links.packets import OVERHEAD_BAUD, PACKET_BYTES, Overhead, encode, encode_page
from kilotwin.table.links.robot_link import Report
from kilotwin.table.ports.serial_port import SerialPort

# From page to page. KiloGUI waits for 130 ms; the packet takes 34.4 ms on the line, and then the
# controller, which receives nothing meanwhile, sends 22 frames of 4.45 ms.
_PAGE_S = 0.135
_ANNOUNCE_S = 0.25


class OverheadRobots:
    """All robots in the light of one overhead controller; see RobotLink."""

    verifies = False
    laps_per_place = 1

    def __init__(self, port: str, clock: Clock | None = None) -> None:
        """Opens the port for us alone; DeviceError if it is not there or taken."""
        self.name = f"ohc:{port}"
        self._clock = clock or WallClock()
        self._port = SerialPort(port, OVERHEAD_BAUD)
        self._packet_s = PACKET_BYTES * self._port.byte_s

    def repeat(self, message: bytes, hold_s: float) -> None:
        """A frame each 10.4 ms."""
        self._send(encode(Overhead.FORWARDMSG, message))
        self._clock.sleep(hold_s)
        self._send(encode(Overhead.STOP))

    def announce(self, image: FlashImage) -> None:
        """With CRC and id, which original loaders overlook."""
        self.repeat(messages.size(image), _ANNOUNCE_S)

    def send_page(self, page: int, data: bytes) -> None:
        """22 frames back to back."""
        self._port.write(encode_page(Overhead.BOOTPAGE, page, data))
        self._clock.sleep(_PAGE_S)

    def ask(self, first: int, slots_log2: int, nonce: int, uid: int = ALL_ROBOTS) -> list[Report]:
        """Nothing: robots are not asked, as their answers would not be heard."""
        return []

    def close(self) -> None:
        """Silence, and the port is free."""
        self._port.close()

    def _send(self, packet: bytes) -> None:
        """Returns when the controller has it."""
        self._port.write(packet)
        self._clock.sleep(self._packet_s)
