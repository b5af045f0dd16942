"""The bridge, seen from programs outside: python-can's socketcand interface and bare sockets."""

import contextlib
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest

from kilotwin._emulator import CAN_RECORD, Bridge, BridgeError
from kilotwin.errors import DeviceError
from kilotwin.table.can.bridge import open_bridge
from kilotwin.table.can.buses import open_bus, parse_bus

RECORD = np.dtype(CAN_RECORD)
PATIENCE_S = 600.0
"""The machine may be busy: how long anything may take that is sure to come."""


def frames(count: int, *, bus: int = 0, from_host: bool = False, first: int = 0) -> Any:
    """Frames of identifier 0x43, eight bytes that number them, a millisecond apart."""
    rows = np.zeros(count, RECORD)
    numbers = np.arange(first, first + count, dtype=np.uint64)
    rows["at_s"], rows["bus"], rows["id"], rows["dlc"] = numbers * 0.001, bus, 0x43, 8
    rows["data"] = numbers.view(np.uint8).reshape(-1, 8)
    rows["from_host"] = from_host
    return rows


def number_of(message: can.Message) -> int:
    return int.from_bytes(message.data, "little")


def until(done: Callable[[], Any]) -> Any:
    """Result of `done` as soon as it is true."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if result := done():
            return result
        time.sleep(0.002)
    raise AssertionError("it did not happen")


def taken_from(bridge: Bridge, count: int) -> list[tuple[int, int, bytes]]:
    """Frames that come in, until they are `count` or more."""
    taken: list[tuple[int, int, bytes]] = []

    def enough() -> bool:
        taken.extend(frame[:3] for frame in bridge.take())
        return len(taken) >= count

    until(enough)
    return taken


@pytest.fixture
def bridge() -> Iterator[Bridge]:
    made = open_bridge(buses=4, port=0, settle_s=0.02)
    yield made
    made.close()


def client_of(bridge: Bridge, channel: str = "can0") -> can.BusABC:
    return can.Bus(
        interface="socketcand", host="127.0.0.1", port=bridge.port, channel=channel, tcp_tune=True
    )


class Raw:
    """A client that speaks the protocol by hand."""

    def __init__(self, bridge: Bridge, *, small: bool = False) -> None:
        self.socket = socket.socket()
        if small:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self.socket.settimeout(PATIENCE_S)
        self.socket.connect(("127.0.0.1", bridge.port))
        assert self.reply() == "< hi >"

    def __del__(self) -> None:
        self.socket.close()

    def reply(self) -> str:
        """One answer."""
        text = b""
        while not text.endswith(b">"):
            byte = self.socket.recv(1)
            if not byte:
                raise ConnectionError(f"closed after {text!r}")
            text += byte
        return text.decode()

    def ask(self, command: str) -> str:
        self.socket.sendall(command.encode())
        return self.reply()

    def listen(self, channel: str = "can0") -> "Raw":
        assert self.ask(f"< open {channel} >") == "< ok >"
        assert self.ask("< rawmode >") == "< ok >"
        return self


def received(bus: can.BusABC, count: int) -> list[can.Message]:
    got: list[can.Message] = []

    def enough() -> bool:
        message = bus.recv(0.05)
        while message is not None:
            got.append(message)
            message = bus.recv(0) if len(got) < count else None
        return len(got) >= count

    until(enough)
    return got


def test_python_can_hears_what_is_published_with_its_time(bridge: Bridge) -> None:
    with client_of(bridge) as bus:
        bridge.publish(frames(1000))
        got = received(bus, 1000)
        assert [number_of(m) for m in got] == list(range(1000))
        assert {(m.arbitration_id, m.dlc, m.is_extended_id) for m in got} == {(0x43, 8, False)}
        assert [m.timestamp for m in got] == pytest.approx(np.arange(1000) * 0.001, abs=1e-9)
    assert bridge.counts()["lost_outgoing"] == 0


def test_what_python_can_sends_is_taken_in_order(bridge: Bridge) -> None:
    with client_of(bridge, "can3") as bus:
        for number in range(300):
            data = number.to_bytes(2, "little")[: number % 3]
            bus.send(can.Message(arbitration_id=number, data=data, is_extended_id=False))
        taken = taken_from(bridge, 300)
    assert taken == [(3, n, n.to_bytes(2, "little")[: n % 3]) for n in range(300)]
    assert bridge.counts()["malformed"] == 0


def test_frames_published_during_the_handshake_do_not_break_it(bridge: Bridge) -> None:
    """python-can fails if a frame comes together with the answer to rawmode."""
    for _ in range(10):
        client = Raw(bridge)
        assert client.ask("< open can0 >") == "< ok >"
        client.socket.sendall(b"< rawmode >")
        until(lambda: bridge.clients)
        bridge.publish(frames(50))
        time.sleep(0.005)
        assert client.socket.recv(256) == b"< ok >"
        client.socket.close()
    with client_of(bridge) as bus:
        bridge.publish(frames(1, first=7))
        assert number_of(received(bus, 1)[-1]) == 7


def test_each_client_hears_its_own_bus(bridge: Bridge) -> None:
    with client_of(bridge, "can1") as first, client_of(bridge, "can2") as second:
        bridge.publish(np.concatenate([frames(3, bus=1), frames(2, bus=2), frames(5)]))
        bridge.publish(np.concatenate([frames(1, bus=1, first=9), frames(1, bus=2, first=9)]))
        assert [number_of(m) for m in received(first, 4)] == [0, 1, 2, 9]
        assert [number_of(m) for m in received(second, 3)] == [0, 1, 9]


def test_it_is_known_how_long_ago_a_frame_came(bridge: Bridge) -> None:
    """So that a table can keep the pauses between frames."""
    client = Raw(bridge)
    assert client.ask("< open can0 >") == "< ok >"
    began_s = time.monotonic()
    client.socket.sendall(b"< send 1 0 >")
    assert client.ask("< echo >") == "< echo >"
    time.sleep(0.05)
    ((*_, age_s),) = bridge.take()
    assert 0.05 <= age_s <= time.monotonic() - began_s


def test_a_clients_frame_comes_back_to_the_others_and_not_to_itself(bridge: Bridge) -> None:
    with client_of(bridge) as sender, client_of(bridge) as other:
        message = can.Message(arbitration_id=0x43, data=bytes(8), is_extended_id=False)
        sender.send(message)
        assert taken_from(bridge, 1) == [(0, 0x43, bytes(8))]
        bridge.publish(frames(1, from_host=True))
        # From the host as well, but no client sent it: all receive it.
        bridge.publish(frames(1, from_host=True, first=5))
        assert [number_of(m) for m in received(other, 2)] == [0, 5]
        assert [number_of(m) for m in received(sender, 1)] == [5]


def test_a_frame_without_data_arrives(bridge: Bridge) -> None:
    with client_of(bridge) as bus:
        empty = frames(1)
        empty["dlc"] = 0
        bridge.publish(empty)
        assert received(bus, 1)[0].dlc == 0


def test_the_server_answers_as_socketcand_does(bridge: Bridge) -> None:
    client = Raw(bridge)
    assert client.ask("< echo >") == "< echo >"
    assert client.ask("< send 1 0 >") == "< error unknown command >"  # no bus is open
    assert client.ask("<open can1>") == "< ok >"
    assert client.ask("< subscribe 0 0 123 >") == "< error unknown command >"
    for wrong in ("800 0", "1 9", "1 2 11", "1 1 11 22", "1 1 1FF", "1 1 GG", "12345678 0", ""):
        answer = client.ask(f"< send {wrong} >")
        assert answer == "< error syntax error in send command >", wrong
    assert client.ask("< rawmode >") == "< ok >"
    bridge.publish(frames(1, bus=1))
    assert client.reply() == "< frame 043 0.000000 0000000000000000 >"
    assert client.ask("< bcmmode >") == "< ok >"
    bridge.publish(frames(1, bus=1))
    assert client.ask("< echo >") == "< echo >"
    assert bridge.take() == []
    assert bridge.counts()["malformed"] == 10


@pytest.mark.parametrize("name", ["can4", "can", "vcan0", "can-1", "can99999999999"])
def test_a_bus_that_is_not_there_is_refused_and_the_connection_closed(
    bridge: Bridge, name: str
) -> None:
    client = Raw(bridge)
    assert client.ask(f"< open {name} >") == "< error could not open bus >"
    with pytest.raises(ConnectionError):
        client.reply()


def test_garbage_is_counted_and_harms_nobody(bridge: Bridge) -> None:
    with client_of(bridge) as bus:
        random = np.random.default_rng(1)
        for _ in range(20):
            client = Raw(bridge)
            noise = random.integers(0, 256, 5000, dtype=np.uint8).tobytes()
            with contextlib.suppress(ConnectionError):
                client.socket.sendall(noise + b"< open can0 >< send 1 1 >" + b"<" + b"x" * 5000)
                client.socket.settimeout(0.05)
                with contextlib.suppress(TimeoutError):
                    client.socket.recv(1 << 16)
            client.socket.close()
        until(lambda: bridge.clients == 1)
        bridge.publish(frames(10))
        assert [number_of(m) for m in received(bus, 10)] == list(range(10))
    assert bridge.counts()["malformed"] > 100
    assert bridge.take() == []


def test_a_client_that_never_reads_is_dropped_and_the_others_lose_nothing() -> None:
    bridge = open_bridge(buses=1, port=0, settle_s=0.01, client_bytes=100_000)
    sleeper = Raw(bridge, small=True).listen()
    with client_of(bridge) as bus:
        got: list[int] = []
        for first in range(0, 200_000, 1000):
            bridge.publish(frames(1000, first=first))
            got += [number_of(m) for m in received(bus, 1000)]
            if bridge.clients == 1:
                break
        assert got == list(range(len(got)))
    until(lambda: bridge.counts()["clients_dropped"] == 1)
    assert [note for note in bridge.notes() if "reads too slowly" in note]
    sleeper.socket.close()
    bridge.close()


def test_a_client_that_vanishes_is_forgotten(bridge: Bridge) -> None:
    clients = [Raw(bridge).listen() for _ in range(5)]
    until(lambda: bridge.clients == 5)
    for client in clients:
        # As if killed: the connection is reset, not closed.
        client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        client.socket.close()
    bridge.publish(frames(100))
    until(lambda: bridge.clients == 0)
    with client_of(bridge) as bus:
        bridge.publish(frames(1))
        received(bus, 1)


def test_a_client_that_floods_waits_until_its_frames_are_taken() -> None:
    bridge = open_bridge(buses=1, port=0, client_frames=100)
    flooder, calm = Raw(bridge).listen(), Raw(bridge).listen()
    flooder.socket.setblocking(False)
    command, sent = b"< send 100 2 11 22 >" * 500, 0
    stuck_since = time.monotonic()
    # Nothing is taken: at some time the kernel's buffers are full, and it can send no more.
    while time.monotonic() - stuck_since < 0.5:
        with contextlib.suppress(BlockingIOError):
            sent += flooder.socket.send(command[sent % 20 :])
            stuck_since = time.monotonic()
    calm.socket.sendall(b"< send 200 0 >")
    # One stuck client does not keep the other's frame back.
    taken = taken_from(bridge, 1)
    while (0, 0x200, b"") not in taken:
        taken += taken_from(bridge, 1)
    taken += taken_from(bridge, sent // 20 + 1 - len(taken))
    assert len(taken) == sent // 20 + 1
    assert bridge.counts()["lost_incoming"] == bridge.counts()["malformed"] == 0
    bridge.close()


def test_a_client_too_many_is_turned_away() -> None:
    bridge = open_bridge(buses=1, port=0, clients=2)
    first, second = Raw(bridge).listen(), Raw(bridge).listen()
    with pytest.raises(AssertionError, match="< error too many clients >"):
        Raw(bridge)
    assert first.ask("< echo >") == second.ask("< echo >") == "< echo >"
    assert [note for note in bridge.notes() if "turned away" in note]
    bridge.close()


def test_idle_connections_do_not_keep_a_host_out() -> None:
    bridge = open_bridge(buses=1, port=0, clients=4)
    watches = Raw(bridge).listen()
    idle = [Raw(bridge) for _ in range(20)]
    host = open_bus(replace(parse_bus(f"socketcand:127.0.0.1:{bridge.port}"), channel="can0"))
    host.bus.send(can.Message(arbitration_id=0x123, is_extended_id=False))
    assert taken_from(bridge, 1) == [(0, 0x123, b"")]
    host.bus.shutdown()
    assert watches.ask("< echo >") == "< echo >"
    assert idle[0].reply() == "< error too many clients >"
    bridge.close()


# python-can leaves the socket open.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_host_that_is_turned_away_is_told_why() -> None:
    bridge = open_bridge(buses=1, port=0, clients=1)
    watches = Raw(bridge).listen()
    with pytest.raises(DeviceError, match=r"too many clients.*; so many programs watch the table"):
        open_bus(replace(parse_bus(f"socketcand:127.0.0.1:{bridge.port}"), channel="can0"))
    assert watches.ask("< echo >") == "< echo >"
    bridge.close()


def test_a_port_in_use_gives_the_next_one() -> None:
    first = open_bridge(buses=1, port=0)
    second = open_bridge(buses=1, port=first.port)
    assert first.port < second.port <= first.port + 15
    with pytest.raises(BridgeError, match=f"no port from {first.port}"):
        open_bridge(buses=1, port=first.port, more_ports=0)
    first.close()
    second.close()


def test_only_this_machine_can_connect(bridge: Bridge) -> None:
    lines = Path("/proc/net/tcp").read_text().splitlines()
    listening = [line.split()[1] for line in lines if line.split()[3] == "0A"]
    assert f"0100007F:{bridge.port:04X}" in listening
    assert f"00000000:{bridge.port:04X}" not in listening


def test_publishing_never_waits_whatever_clients_do() -> None:
    bridge = open_bridge(buses=1, port=0, client_bytes=100_000)
    sleepers = [Raw(bridge, small=True).listen() for _ in range(10)]
    batch = frames(2000)
    longest = 0.0
    for _ in range(50):
        begin = time.thread_time()
        bridge.publish(batch)
        longest = max(longest, time.thread_time() - begin)
    assert longest < 0.1
    until(lambda: bridge.clients == 0)
    for sleeper in sleepers:
        sleeper.socket.close()
    bridge.close()


def test_a_closed_bridge_says_so_and_its_clients_are_disconnected(bridge: Bridge) -> None:
    other = open_bridge(buses=1, port=0)
    client = Raw(other)
    other.close()
    with pytest.raises(ConnectionError):
        client.reply()
    with pytest.raises(BridgeError, match="closed"):
        other.take()


def test_what_is_no_array_of_frames_is_an_error(bridge: Bridge) -> None:
    with pytest.raises(TypeError, match="CAN_RECORD"):
        bridge.publish(np.zeros(3))
    with pytest.raises(ValueError, match="contiguous"):
        bridge.publish(frames(4)[::2])
    bridge.publish(frames(0))


def test_a_frame_of_a_bus_that_is_not_there_is_counted_as_lost(bridge: Bridge) -> None:
    bridge.publish(frames(3, bus=4))
    assert bridge.counts()["lost_outgoing"] == 3


def test_interfaces_that_are_not_there_are_errors() -> None:
    with pytest.raises(BridgeError, match=r"SocketCAN|no interface"):
        open_bridge(buses=1, interfaces=["no-such-can"])
    with pytest.raises(BridgeError, match="for each bus: 2, not 1"):
        open_bridge(buses=2, interfaces=["vcan0"])
