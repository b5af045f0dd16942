"""Robots' poses as lines of JSON in UDP datagrams: what a tracker tells us, and an emulated one.

A line is a picture, or a part of one, an object with a list of robots:

    {"robots": [{"uid": 7, "x_m": 0.1, "y_m": -0.05, "heading_rad": 1.57, "led": [0, 3, 0]}]}

`led` may be left out; other keys are overlooked. A datagram holds one line or more.
"""

import contextlib
import json
import math
import reprlib
import socket
from collections.abc import Iterable
from typing import Any

from kilotwin.errors import DeviceError, InputError, cause_of
from kilotwin.table.environment.protocol import SeenRobot

# Below what a network passes on in one piece.
_DATAGRAM_BYTES = 1400
_LARGEST_DATAGRAM = 65_536
_EXAMPLE = "udp:HOST:PORT, as in udp:127.0.0.1:5005"
_LAST_UID = 65_534
_BRIGHTEST = 3

Address = tuple[str, int]


def parse_address(text: str) -> Address:
    """Host and port of `udp:HOST:PORT`; InputError has the form."""
    kind, _, rest = text.partition(":")
    host, _, port = rest.rpartition(":")
    if kind != "udp" or not host or not port.isdecimal() or not 0 < int(port) < 65_536:
        raise InputError(f"--poses {text}: write {_EXAMPLE}")
    return host.strip("[]"), int(port)


def read_line(line: bytes) -> list[SeenRobot]:
    """The robots of a line; ValueError says what is wrong with it."""
    try:
        said = json.loads(line)
    except (ValueError, RecursionError):
        raise ValueError("it is not JSON") from None
    robots = said.get("robots") if isinstance(said, dict) else None
    if not isinstance(robots, list):
        raise ValueError('it is no object with a list "robots"')
    return [_robot(robot) for robot in robots]


def _robot(said: Any) -> SeenRobot:
    if not isinstance(said, dict):
        raise ValueError("a robot is no object")
    uid = said.get("uid")
    if type(uid) is not int or not 0 <= uid <= _LAST_UID:
        raise ValueError(f"uid is {uid!r}; it must be 0 to {_LAST_UID}")
    x, y, heading = (_number(said, key) for key in ("x_m", "y_m", "heading_rad"))
    return SeenRobot(uid, x, y, heading, _led(said.get("led")))


def _number(said: dict[str, Any], key: str) -> float:
    value = said.get(key)
    number = math.nan
    if isinstance(value, int | float) and not isinstance(value, bool):
        with contextlib.suppress(OverflowError):
            number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{key} is {reprlib.repr(value)}; it must be a number")
    return number


def _led(value: Any) -> tuple[int, int, int] | None:
    if value is None:
        return None
    if (
        not isinstance(value, list)
        or len(value) != 3
        or not all(type(part) is int and 0 <= part <= _BRIGHTEST for part in value)
    ):
        raise ValueError(f"led is {value!r}; it must be [red, green, blue], 0 to 3 each")
    return value[0], value[1], value[2]


def write_lines(robots: Iterable[SeenRobot]) -> list[bytes]:
    """Datagrams of one line each, none too long for a network."""
    said = [
        json.dumps(
            {
                "uid": robot.uid,
                "x_m": round(robot.x_m, 5),
                "y_m": round(robot.y_m, 5),
                "heading_rad": round(robot.heading_rad, 4),
                **({} if robot.led is None else {"led": robot.led}),
            }
        )
        for robot in robots
    ]
    lines: list[list[str]] = []
    room = 0
    for robot in said:
        if room < len(robot):
            lines.append([])
            room = _DATAGRAM_BYTES
        lines[-1].append(robot)
        room -= len(robot) + 2
    return [f'{{"robots": [{", ".join(line)}]}}\n'.encode() for line in lines]


class PoseListener:
    """Datagrams that have come to an address of ours."""

    def __init__(self, address: Address) -> None:
        """DeviceError if the port is taken."""
        self.lines = 0
        """So many came."""
        self.bad_lines = 0
        """Number of these that were of no use."""
        self.trouble: str | None = None
        """The fault of the last of them."""
        family = socket.AF_INET6 if ":" in address[0] else socket.AF_INET
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind(address)
        except OSError as error:
            self._socket.close()
            where = f"udp:{address[0]}:{address[1]}"
            raise DeviceError(
                f"--poses {where}: {cause_of(error)}; end what listens there, or name another port"
            ) from None

    @property
    def address(self) -> Address:
        """Where it listens, with the port that 0 became."""
        host, port = self._socket.getsockname()[:2]
        return host, port

    def take(self) -> list[SeenRobot]:
        """The robots of all lines since the last call, each as it was seen last."""
        robots: dict[int, SeenRobot] = {}
        while True:
            try:
                datagram = self._socket.recv(_LARGEST_DATAGRAM)
            except BlockingIOError:
                return sorted(robots.values(), key=lambda robot: robot.uid)
            for line in datagram.splitlines():
                robots.update((robot.uid, robot) for robot in self._read(line))

    def _read(self, line: bytes) -> list[SeenRobot]:
        self.lines += 1
        try:
            return read_line(line)
        except ValueError as error:
            self.bad_lines += 1
            self.trouble = str(error)
            return []

    def close(self) -> None:
        """Gives the port up."""
        self._socket.close()


class PoseSender:
    """An emulated tracker's way to its listener. Nobody need listen."""

    def __init__(self, address: Address) -> None:
        """InputError if the host has no address."""
        try:
            found = socket.getaddrinfo(*address, type=socket.SOCK_DGRAM)
        except OSError as error:
            where = f"udp:{address[0]}:{address[1]}"
            raise InputError(f"--poses {where}: {error.strerror}; name another host") from None
        family, kind, protocol, _, to = found[0]
        self._socket = socket.socket(family, kind, protocol)
        self._socket.setblocking(False)
        # Connected, for a confined process may send to no other address (docs/security.md).
        with contextlib.suppress(OSError):
            self._socket.connect(to)

    def send(self, datagram: bytes) -> None:
        """Datagrams that the network does not take are lost."""
        with contextlib.suppress(OSError):
            self._socket.send(datagram)

    def close(self) -> None:
        """Gives the socket up."""
        self._socket.close()
