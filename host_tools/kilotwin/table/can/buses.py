"""Opens the CAN buses that a user names: `IFACE:CHANNEL`, with any interface python-can knows.

socketcan:can0                  the kernel's
socketcand:127.0.0.1            an emulated grid, or another machine's buses: all of them
socketcand:127.0.0.1:29536/can1 one of them
slcan:/dev/ttyACM0              a serial adapter
kilogrid:/dev/ttyUSB0           a Kilogrid's dispatcher: one for the whole grid
"""

import contextlib
import logging
import socket
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import can

from kilotwin.errors import DeviceError, InputError
from kilotwin.files.headers import CAN_BIT_RATE
from kilotwin.table.can.address import SOCKETCAND_PORT
from kilotwin.table.ports.list_ports import this_computer_has

# A vcan loses nothing, but the socket's own buffer does when the host is busy for a moment.
_RECEIVE_BYTES = 8 << 20
_CONNECT_S = 3.0
_DISPATCHER = "kilogrid"
_EXAMPLES = "socketcan:can0, socketcand:127.0.0.1 or slcan:/dev/ttyACM0"


@dataclass(frozen=True)
class BusName:
    """One bus as a user names it; `channel` is None for "as many as the grid has"."""

    interface: str
    channel: str | None
    host: str = ""
    port: int = 0
    size: tuple[int, int] | None = None
    """Columns and rows of the grid: a dispatcher has to be told."""

    def __str__(self) -> str:
        if self.interface != "socketcand":
            return f"{self.interface}:{self.channel}"
        return f"socketcand:{self.host}:{self.port}" + (f"/{self.channel}" if self.channel else "")


@dataclass(frozen=True)
class OpenBus:
    """A bus in use.

    `echoes`: it also hands back what was sent, in its place. `answers`: what modules say comes
    through; a dispatcher passes on robots' reports only.
    """

    bus: can.BusABC
    name: str
    echoes: bool
    answers: bool = True


def parse_bus(text: str) -> BusName:
    """A bus as `--can` names it, IFACE:CHANNEL; InputError if it is not of that form."""
    interface, colon, rest = text.partition(":")
    if not colon or not rest:
        raise InputError(f"--can {text}: not IFACE:CHANNEL; try {_EXAMPLES}")
    if interface not in can.VALID_INTERFACES:
        known = ", ".join(sorted(can.VALID_INTERFACES))
        raise InputError(f"--can {text}: there is no interface '{interface}'; allowed: {known}")
    if interface != "socketcand":
        return BusName(interface, rest)
    place, _, channel = rest.partition("/")
    host, colon, port = place.partition(":")
    if not host or (colon and not (port.isdecimal() and 0 < int(port) < 65536)):
        raise InputError(f"--can {text}: not socketcand:HOST[:PORT][/CHANNEL]")
    return BusName(interface, channel or None, host, int(port) if colon else SOCKETCAND_PORT)


def name_all(names: Sequence[str], buses: int, size: tuple[int, int]) -> list[BusName]:
    """A name for each bus of a grid of `size`; InputError if there are too few or too many.

    One for all buses if it is a dispatcher.
    """
    if not names:
        raise InputError(f"on which CAN bus? Name it, as in --can {_EXAMPLES}")
    parsed = [parse_bus(name) for name in names]
    if len(parsed) == 1 and parsed[0].interface == "socketcand" and parsed[0].channel is None:
        one = parsed[0]
        return [BusName(one.interface, f"can{n}", one.host, one.port) for n in range(buses)]
    if len(parsed) == 1 and parsed[0].interface == _DISPATCHER:
        return [replace(parsed[0], size=size)]
    for name in parsed:
        if name.interface == _DISPATCHER:
            raise InputError(f"--can {name}: a dispatcher has all buses; name nothing else")
        if name.channel is None:
            raise InputError(f"--can {name}: which bus? Name it, as in {name}/can0")
    if len(parsed) != buses:
        named = "one bus is" if len(parsed) == 1 else f"{len(parsed)} buses are"
        what = f"{named} named, but the grid has {buses}"
        raise InputError(f"--can: {what}; give --can once per bus, the lowest rows first")
    return parsed


def need_answers(names: Sequence[BusName], instead: str) -> None:
    """InputError, with what to do `instead`, if answers do not come through one of these."""
    for name in names:
        if name.interface == _DISPATCHER:
            raise InputError(f"--can {name}: no answers come through a dispatcher; {instead}")


def open_all(names: Sequence[BusName]) -> list[OpenBus]:
    """All of them, or DeviceError and none."""
    logging.getLogger("can").setLevel(logging.CRITICAL)  # errors are printed in our words
    with contextlib.ExitStack() as opened:
        buses = []
        for name in names:
            bus = open_bus(name)
            opened.callback(bus.bus.shutdown)
            buses.append(bus)
        opened.pop_all()
    return buses


def close_all(buses: Sequence[OpenBus]) -> None:
    """Closes them again."""
    for bus in buses:
        bus.bus.shutdown()


def open_bus(name: BusName) -> OpenBus:
    """Opens one bus; DeviceError has the command to type."""
    try:
        return _open(name)
    except (can.CanError, OSError, ValueError, ImportError, TypeError) as error:
        if missing := _not_there(name):
            raise DeviceError(f"--can {name}: {missing}") from None
        reason = (getattr(error, "strerror", None) or str(error) or type(error).__name__).lower()
        raise DeviceError(f"--can {name}: {reason}; {_remedy(name, reason)}") from None


def _open(name: BusName) -> OpenBus:
    assert name.channel is not None
    if name.interface == "socketcand":
        # python-can would try for ten seconds.
        with socket.create_connection((name.host, name.port), timeout=_CONNECT_S):
            pass
        bus = can.Bus(interface="socketcand", channel=name.channel, host=name.host, port=name.port)
        return OpenBus(bus, name.channel, echoes=False)
    if name.interface == "socketcan":
        bus = can.Bus(interface="socketcan", channel=name.channel, receive_own_messages=True)
        _widen(bus)
        return OpenBus(bus, name.channel, echoes=True)
    if name.interface == _DISPATCHER:
        bus = can.Bus(interface=_DISPATCHER, channel=name.channel, size=name.size)
        return OpenBus(bus, name.channel.rpartition("/")[2], echoes=False, answers=False)
    more: dict[str, Any] = {} if name.interface == "virtual" else {"bitrate": CAN_BIT_RATE}
    if name.interface == "slcan":
        more["sleep_after_open"] = 0
    bus = can.Bus(interface=name.interface, channel=name.channel, **more)
    return OpenBus(bus, name.channel.rpartition("/")[2], echoes=False)


def _widen(bus: can.BusABC) -> None:
    handle = getattr(bus, "socket", None)
    for option in ("SO_RCVBUFFORCE", "SO_RCVBUF"):  # the first is for root only
        # Linux has the first one, Python does not name it.
        number = 33 if option == "SO_RCVBUFFORCE" else socket.SO_RCVBUF
        with contextlib.suppress(OSError, AttributeError):
            assert handle is not None
            handle.setsockopt(socket.SOL_SOCKET, number, _RECEIVE_BYTES)
            return


def _remedy(name: BusName, reason: str) -> str:
    if name.interface == "socketcand" and "too many clients" in reason:
        return (
            f"so many programs watch the table at {name.host}:{name.port} already that it takes no "
            "more; end some of them, such as candump"
        )
    if name.interface == "socketcand" and "could not open bus" in reason:
        server = f"--can socketcand:{name.host}:{name.port}"
        return (
            f"the table there has no {name.channel}; name each bus that it has, the lowest rows "
            f"first, as in {server}/can0 {server}/can1"
        )
    if name.interface == "socketcand":
        where = "" if name.port == SOCKETCAND_PORT else f" on port {name.port}"
        return f"is `kilotwin serve world EXP.toml` running there{where}? It prints what to type"
    if name.interface == "socketcan":
        return f"type: ip link set {name.channel} up type can bitrate {CAN_BIT_RATE} restart-ms 100"
    return "is the adapter plugged in, and may you use it? `kilotwin doctor` lists what is there"


def _not_there(name: BusName) -> str:
    """Says that an interface or port is missing, and which ones there are; "" if it is there."""
    channel = str(name.channel)
    if name.interface == "socketcan" and channel not in {it for _, it in socket.if_nameindex()}:
        has = ", ".join(interfaces()) or "no CAN interface at all"
        return (
            f"this computer has {has}; name one that is there, or plug the adapter in and type: ip "
            f"link set {channel} up type can bitrate {CAN_BIT_RATE} restart-ms 100"
        )
    if "/dev/" in channel and ":" not in channel and not Path(channel.partition("@")[0]).exists():
        has = this_computer_has()
        return f"{channel} is not there; plug the adapter in, or name another port: {has}"
    return ""


def interfaces() -> list[str]:
    """The kernel's CAN interfaces, by name."""
    found = []
    for _, name in socket.if_nameindex():
        with contextlib.suppress(OSError, AttributeError):
            handle = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
            with handle:
                handle.bind((name,))
            found.append(name)
    return found
