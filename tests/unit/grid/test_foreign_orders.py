"""Hosts see one another by their orders, and by what they say between orders."""

from collections.abc import Sequence

import numpy as np
import pytest

from kilotwin.table.can.address import HOST_ID
from kilotwin.table.can.protocol import read_to_host, to_module
from kilotwin.table.grid.foreign_orders import LISTEN_S, WatchedLinks
from kilotwin.table.grid.links import FRAME, NO_FRAMES, Frames


class Wire:
    """A bus that two hosts share: what one sends both see, and it knows who sent it."""

    def __init__(self) -> None:
        self.ends: list[End] = []

    def end(self) -> "End":
        self.ends.append(End(self))
        return self.ends[-1]


class End:
    """A host's end of the wire."""

    def __init__(self, wire: Wire) -> None:
        self.wire = wire
        self.waiting: list[Frames] = []
        self.sent: list[tuple[float, int, bytes]] = []
        self.down = False

    def __len__(self) -> int:
        return 1

    def send(self, bus: int, identifier: int, data: bytes, now_s: float) -> bool:
        self.sent.append((now_s, identifier, data))
        for end in self.wire.ends:
            row = np.zeros(1, dtype=FRAME)
            row[0] = (now_s, bus, identifier, len(data), list(data.ljust(8, b"\0")), end is self)
            end.waiting.append(row)
        return True

    def send_all(self, bus: int, identifiers: Sequence[int], data: bytes, now_s: float) -> int:
        return sum(self.send(bus, identifier, data, now_s) for identifier in identifiers)

    def trouble(self, bus: int) -> str | None:
        return "unplugged" if self.down else None

    def receive(self, now_s: float) -> Frames:
        frames = np.concatenate(self.waiting) if self.waiting else NO_FRAMES
        self.waiting = []
        return frames

    def close(self) -> None:
        pass


def test_a_host_without_orders_is_seen_by_another_and_not_by_itself() -> None:
    wire = Wire()
    one = WatchedLinks(wire.end(), announces=True)
    other = WatchedLinks(wire.end())
    for step in range(round(LISTEN_S / 0.01)):
        assert len(one.receive(step / 100)) == 0
        assert len(other.receive(step / 100)) == 0
    assert not one.foreign
    assert other.foreign[0, "HOST_PRESENT"] >= 2


def test_two_hosts_that_say_so_see_each_other() -> None:
    wire = Wire()
    hosts = [WatchedLinks(wire.end(), announces=True) for _ in range(2)]
    for step in range(50):
        for host in hosts:
            host.receive(step / 100)
    assert all(host.foreign[0, "HOST_PRESENT"] >= 2 for host in hosts)


def test_what_is_sent_has_an_identifier_that_no_module_takes_and_goes_out_five_times_a_second() -> (
    None
):
    end = Wire().end()
    links = WatchedLinks(end, announces=True)
    for step in range(1000):
        links.receive(step / 100)
    assert {identifier for _, identifier, _ in end.sent} == {HOST_ID}
    assert len({data for _, _, data in end.sent}) == 1
    assert type(read_to_host(end.sent[0][2])).__name__ == "HostPresent"
    assert 45 <= len(end.sent) <= 50


def test_nothing_is_said_on_a_bus_that_does_not_work() -> None:
    end = Wire().end()
    end.down = True
    WatchedLinks(end, announces=True).receive(0.0)
    assert not end.sent


@pytest.mark.parametrize("own", [True, False])
def test_an_order_is_foreign_if_it_was_not_sent_from_here(own: bool) -> None:
    wire = Wire()
    here, there = WatchedLinks(wire.end()), WatchedLinks(wire.end())
    (here if own else there).send(0, 0, to_module("MODULE_IDLE"), 0.0)
    assert len(here.receive(0.1)) == 1
    assert bool(here.foreign) is not own
