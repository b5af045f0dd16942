"""The order and the pace in which an environment's words go out."""

import pytest

from kilotwin.experiment.spec.ark import Layout
from kilotwin.experiment.spec.overhead import RUN, message
from kilotwin.table.environment.outbox import PACKET_S, Outbox, Sending
from kilotwin.table.links.packets import Overhead, ToDevice

MESSAGE_S = 0.05


@pytest.fixture
def outbox() -> Outbox:
    return Outbox(MESSAGE_S, range(1, 21), Layout(10, 4, 10))


def words(sending: Sending) -> list[tuple[int, int, int]]:
    told = [wanted.word for wanted in sending.told]
    return [(word.uid, word.type, word.value) for word in told if word is not None]


def kinds(sendings: list[Sending]) -> list[int]:
    """Types of the packets, as the device finds them."""
    stream = ToDevice()
    return [stream.take(sending.packet)[0].type for sending in sendings]


def test_three_robots_share_a_packet_and_packets_keep_their_pace(outbox: Outbox) -> None:
    for uid in range(1, 8):
        outbox(uid, 10 * uid)
    sent = list(outbox.sendings(1.0, 2.0))
    assert [words(sending) for sending in sent[:3]] == [
        [(1, 0, 10), (2, 0, 20), (3, 0, 30)],
        [(4, 0, 40), (5, 0, 50), (6, 0, 60)],
        [(7, 0, 70)],
    ]
    assert [sending.at_s for sending in sent[:3]] == pytest.approx([1.0, 1.05, 1.10])
    assert sent[0].there_s == pytest.approx(1.0 + 0.034375)
    assert outbox.waiting == 0


def test_a_newer_word_takes_the_older_one_s_place_in_the_line(outbox: Outbox) -> None:
    for uid in range(1, 6):
        outbox(uid, 1)
    outbox.now_s = 0.5
    outbox(2, 999)
    outbox(2, 7, 3)  # of another type: both are told
    first, second, *_ = outbox.sendings(1.0, 2.0)
    assert words(first) == [(1, 0, 1), (2, 0, 999), (3, 0, 1)]
    assert words(second) == [(4, 0, 1), (5, 0, 1), (2, 3, 7)]
    assert first.told[1].asked_s == 0.5
    assert (outbox.asked, outbox.replaced) == (7, 1)


def test_more_than_the_controller_can_send_costs_words_not_time(outbox: Outbox) -> None:
    latencies = []
    for tick in range(200):
        now = outbox.now_s = tick * 0.1
        for uid in range(1, 21):
            outbox(uid, tick)
        for sending in outbox.sendings(now, now + 0.1):
            latencies += [sending.there_s - wanted.asked_s for wanted in sending.told]
    # Sixty words a second of two hundred; a robot's turn comes each third of a second.
    assert len(latencies) == pytest.approx(60 * 20, rel=0.02)
    assert outbox.replaced == pytest.approx(4000 - 1200, rel=0.02)
    assert max(latencies) < 0.1 + PACKET_S + 1e-9
    assert outbox.waiting <= 20


def test_the_light_goes_out_when_there_is_nothing_more_to_say(outbox: Outbox) -> None:
    outbox(1, 1)
    sent = list(outbox.sendings(0.0, 1.0))
    assert kinds(sent) == [Overhead.FORWARDMSG, Overhead.STOP]
    assert sent[1].at_s == pytest.approx(MESSAGE_S)
    assert list(outbox.sendings(1.0, 2.0)) == []
    # The STOP has the line for as long as any packet.
    outbox(2, 1)
    assert next(iter(outbox.sendings(2.0, 2.04))).at_s == 2.0


def test_what_is_for_all_goes_before_words(outbox: Outbox) -> None:
    outbox(1, 1)
    outbox.to_all([1, 2], 9)
    outbox.to_all([3], 9)
    first, second, *_ = outbox.sendings(0.0, 1.0)
    assert first.told[0].message == message([3], 9)
    assert words(second) == [(1, 0, 1)]


def test_orders_go_before_all_else_in_their_time(outbox: Outbox) -> None:
    outbox.order(0.2, RUN, 0.5)
    outbox(1, 1)
    sent = list(outbox.sendings(0.0, 0.2))
    outbox(2, 1)
    sent += outbox.sendings(0.2, 1.0)
    assert [ToDevice().take(s.packet)[0].data[9] for s in sent if not words(s)][1] == RUN[9]
    order = next(s for s in sent if ToDevice().take(s.packet)[0].data[9] == RUN[9])
    after = sent[sent.index(order) + 1]
    assert order.at_s == pytest.approx(0.2)
    assert after.at_s == pytest.approx(0.7)
    assert words(after) == [(2, 0, 1)]


def test_a_window_begins_where_the_last_one_ended(outbox: Outbox) -> None:
    for uid in range(1, 10):
        outbox(uid, uid)
    whole = Outbox(MESSAGE_S, range(1, 21), Layout(10, 4, 10))
    for uid in range(1, 10):
        whole(uid, uid)
    parts = [s for i in range(100) for s in outbox.sendings(i / 100, (i + 1) / 100)]
    at_once = list(whole.sendings(0, 1))
    assert [s.at_s for s in parts] == pytest.approx([s.at_s for s in at_once])
    assert [s.packet for s in parts] == [s.packet for s in at_once]


def test_what_cannot_be_told_is_refused(outbox: Outbox) -> None:
    with pytest.raises(ValueError, match="there is no robot with the uid 21"):
        outbox(21, 0)
    with pytest.raises(ValueError, match="type is 128; for all robots it must be 0 to 127"):
        outbox.to_all([], 0x80)
    with pytest.raises(ValueError, match="a message has 9 bytes, not 10"):
        outbox.to_all(range(10), 1)
    assert outbox.waiting == 0
