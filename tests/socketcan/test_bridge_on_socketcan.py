"""The bridge on real SocketCAN interfaces, with candump, cansend and python-can as witnesses."""

import contextlib
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest

from kilotwin._emulator import CAN_RECORD, Bridge
from kilotwin.table.can import protocol
from kilotwin.table.can.bridge import open_bridge

pytestmark = pytest.mark.socketcan

BUSES = ["vcan0", "vcan1", "vcan2", "vcan3"]
RECORD = np.dtype(CAN_RECORD)
PATIENCE_S = 600.0


@pytest.fixture
def bridge() -> Iterator[Bridge]:
    made = open_bridge(buses=4, interfaces=BUSES)
    yield made
    made.close()


def frames(count: int, *, bus: int = 0, from_host: bool = False) -> Any:
    """Frames of all lengths and many identifiers, no two alike."""
    rows = np.zeros(count, RECORD)
    numbers = np.arange(count)
    rows["bus"], rows["id"], rows["dlc"] = bus, (numbers * 64 + 3) % 2048, numbers % 9
    rows["data"] = numbers.astype(">u8").view(np.uint8).reshape(-1, 8)[:, ::-1]
    rows["data"][np.arange(8) >= rows["dlc"][:, None]] = 0
    rows["from_host"] = from_host
    return rows


def text_of(row: Any) -> str:
    """A frame as candump -L writes it."""
    return f"{row['id']:03X}#{bytes(row['data'])[: row['dlc']].hex().upper()}"


def until(done: Callable[[], Any]) -> Any:
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


class Candump:
    """candump's log of a bus, from now on."""

    def __init__(self, bus: str, log: Path) -> None:
        self.log = log
        with log.open("w") as file:
            self.process = subprocess.Popen(["candump", "-L", "-r", str(8 << 20), bus], stdout=file)
        # It does not say when it is ready, but then it logs what others send.
        with can.Bus(interface="socketcan", channel=bus) as probe:

            def is_heard() -> bool:
                probe.send(can.Message(arbitration_id=0x7FF, is_extended_id=False))
                time.sleep(0.02)
                return "7FF#" in log.read_text()

            until(is_heard)

    def _read(self) -> list[str]:
        written, _, _ = self.log.read_text().rpartition("\n")  # the last line may be half there
        lines = written.splitlines()
        return [line.split()[2] for line in lines if not line.endswith(" 7FF#")]

    def frames(self, count: int) -> list[str]:
        """All frames up to now, at least `count`."""
        until(lambda: len(self._read()) >= count)
        time.sleep(0.1)  # for those that should not be there
        return self._read()


@contextlib.contextmanager
def candump(bus: str) -> Iterator[Candump]:
    with tempfile.TemporaryDirectory() as folder:
        witness = Candump(bus, Path(folder, "log"))
        try:
            yield witness
        finally:
            witness.process.kill()
            witness.process.wait()


def test_candump_logs_what_is_published_frame_for_frame(bridge: Bridge) -> None:
    rows = frames(3000)
    with candump("vcan0") as witness:
        bridge.publish(rows)
        assert witness.frames(3000) == [text_of(row) for row in rows]
    assert bridge.counts()["lost_outgoing"] == 0


def test_each_bus_has_its_interface(bridge: Bridge) -> None:
    with candump("vcan1") as first, candump("vcan3") as third:
        bridge.publish(np.concatenate([frames(5, bus=3), frames(7, bus=1), frames(9, bus=2)]))
        assert first.frames(7) == [text_of(row) for row in frames(7)]
        assert third.frames(5) == [text_of(row) for row in frames(5)]


def test_what_cansend_sends_is_taken(bridge: Bridge) -> None:
    run = protocol.to_module("MODULE_RUN")
    subprocess.run(["cansend", "vcan2", f"000#{run.hex()}"], check=True)
    subprocess.run(["cansend", "vcan2", "044#15"], check=True)
    taken = taken_from(bridge, 2)
    assert taken == [(2, 0x000, run), (2, 0x044, b"\x15")]


def test_a_burst_from_python_can_is_taken_without_a_loss(bridge: Bridge) -> None:
    with can.Bus(interface="socketcan", channel="vcan0") as bus:
        for number in range(5000):
            data = number.to_bytes(8, "little")
            bus.send(can.Message(arbitration_id=0x42, data=data, is_extended_id=False))
    taken = taken_from(bridge, 5000)
    assert [int.from_bytes(data, "little") for _, _, data in taken] == list(range(5000))
    assert bridge.counts()["lost_incoming"] == 0


def test_python_can_hears_what_is_published(bridge: Bridge) -> None:
    rows = frames(500)
    got: list[tuple[int, bytes]] = []
    with can.Bus(interface="socketcan", channel="vcan0") as bus:
        # python-can leaves its socket's buffer at the system's size: some 200 frames.
        for part in np.split(rows, 5):
            bridge.publish(part)
            for _ in part:
                message = bus.recv(PATIENCE_S)
                assert message is not None
                got.append((message.arbitration_id, bytes(message.data)))
    assert got == [(row["id"], bytes(row["data"])[: row["dlc"]]) for row in rows]


def test_a_frame_from_the_interface_is_not_written_there_again(bridge: Bridge) -> None:
    rows = frames(4, from_host=True)
    with candump("vcan0") as witness:
        until(lambda: not bridge.take())
        with can.Bus(interface="socketcan", channel="vcan0") as bus:
            for row in rows[:2]:
                data = bytes(row["data"])[: row["dlc"]]
                bus.send(
                    can.Message(arbitration_id=int(row["id"]), data=data, is_extended_id=False)
                )
        taken_from(bridge, 2)
        # Two came from there, two from a host inside the simulation.
        bridge.publish(rows)
        assert witness.frames(4) == [text_of(row) for row in rows]


def test_frames_of_29_bits_and_remote_frames_are_counted_and_not_taken(bridge: Bridge) -> None:
    for strange in ("12345678#11", "123#R"):
        subprocess.run(["cansend", "vcan0", strange], check=True)
    subprocess.run(["cansend", "vcan0", "123#11"], check=True)
    assert taken_from(bridge, 1) == [(0, 0x123, b"\x11")]
    assert bridge.counts()["malformed"] == 2


def test_a_bridge_that_closes_leaves_the_interfaces_to_others(bridge: Bridge) -> None:
    bridge.close()
    again = open_bridge(buses=4, interfaces=BUSES)
    subprocess.run(["cansend", "vcan3", "123#11"], check=True)
    assert taken_from(again, 1) == [(3, 0x123, b"\x11")]
    again.close()
