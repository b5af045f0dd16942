"""The run's end of the link to its viewer never waits, and heeds nothing but orders."""

import json
import socket
from collections.abc import Iterator

import numpy as np
import pytest

from kilotwin.runs.packing import head_of, pack
from kilotwin.session.live import Live
from kilotwin.session.live_link import LENGTH, LiveLink
from kilotwin.units import TICK_S

from ..known_run import samples

Ends = tuple[LiveLink, socket.socket]


@pytest.fixture
def ends() -> Iterator[Ends]:
    """The link, and the viewer's end of its socket."""
    run, viewer = socket.socketpair()
    with run, viewer:
        viewer.settimeout(5)
        yield LiveLink(run.fileno()), viewer


def order(**keys: object) -> bytes:
    """An order as it is on the socket."""
    text = json.dumps(keys).encode()
    return LENGTH.pack(len(text)) + text


def message(viewer: socket.socket) -> bytes:
    """The next message."""
    (length,) = LENGTH.unpack(viewer.recv(LENGTH.size, socket.MSG_WAITALL))
    return viewer.recv(length, socket.MSG_WAITALL)


class Standing:
    """An engine whose robots stand."""

    def snapshot(self) -> object:
        return samples([100])


def test_orders_come_whole_however_they_were_cut(ends: Ends) -> None:
    link, viewer = ends
    sent = order(do="look") + order(do="pause", why="é")
    found = []
    for byte in sent:
        viewer.sendall(bytes([byte]))
        found += link.orders()
    assert found == [{"do": "look"}, {"do": "pause", "why": "é"}]


@pytest.mark.parametrize(
    "sent", [order(do="look")[:4] + b"{" * 20, LENGTH.pack(1 << 30), LENGTH.pack(2) + b"[]"]
)
def test_what_is_no_order_ends_the_link(ends: Ends, sent: bytes) -> None:
    link, viewer = ends
    viewer.sendall(sent)
    assert link.orders() == []
    assert link.closed


def test_a_viewer_that_reads_nothing_is_waited_for_by_nobody(ends: Ends) -> None:
    link, viewer = ends
    large = pack({}, {"x_m": np.zeros(1_000_000, np.float32)})
    link.send(large)
    kept = not link.is_free
    assert kept
    received = bytearray()
    while not link.is_free:
        received += viewer.recv(1 << 20)
        link.flush()
    while len(received) < LENGTH.size + len(large):
        received += viewer.recv(1 << 20)
    assert received == LENGTH.pack(len(large)) + large


def test_a_viewer_that_is_gone_disturbs_nothing(ends: Ends) -> None:
    link, viewer = ends
    viewer.close()
    link.send(b"moment")
    assert link.orders() == []
    assert link.closed
    assert link.is_free


def test_a_moment_goes_out_only_when_it_was_asked_for() -> None:
    run, seen = socket.socketpair()
    with run, seen:
        seen.settimeout(5)
        zero_ticks = [0]
        live = Live(run.fileno(), Standing(), zero_tick=lambda: zero_ticks[0])  # type: ignore[arg-type]
        live.heed()
        seen.setblocking(False)
        with pytest.raises(BlockingIOError):
            seen.recv(1)
        seen.settimeout(5)
        seen.sendall(order(do="look") + order(do="look"))
        zero_ticks[0] = 40
        live.heed()
        head = head_of(message(seen))
        assert head["time_s"] == 60 * TICK_S
        assert head["arrays"]["x_m"][2] == 10
        live.heed()
        seen.setblocking(False)
        with pytest.raises(BlockingIOError):
            seen.recv(1)
