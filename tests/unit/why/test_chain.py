"""The chain from what a robot did to its first cause, by facts that are made here."""

from dataclasses import replace

import pytest

from kilotwin.runs.columns import StationKind
from kilotwin.studies.why.chain import (
    Cause,
    CellTold,
    Changed,
    Link,
    Question,
    Received,
    explain,
)
from kilotwin.studies.why.facts import NEVER_S, During, Station, What

from .trails import KnownCode, TrailMaker, message

RED = 3
LED = Question(0, 100.0, What.LED, "led")
MOTORS = Question(0, 100.0, What.MOTORS, "motors")
VARIABLE = Question(0, 100.0, What.ASKED, "count", address=0x300, length=2)
HEARD, TABLE, UNKNOWN = 1, 2, 5


def chain_of(
    trail: TrailMaker, question: Question = LED, depth: int = 8, native: int = -1
) -> list[Link]:
    return explain(trail.facts(), KnownCode(native), question, depth)


def cause_of(links: list[Link]) -> Cause:
    last = links[-1]
    assert isinstance(last, Cause)
    return last


@pytest.fixture
def trail() -> TrailMaker:
    return TrailMaker()


def red_after(trail: TrailMaker, data: bytes, *, variable: int = HEARD, place: int = 1) -> None:
    """Robot 1 tells robot 0 at 10 s, whose loop turns red at 11 s."""
    at_s = trail.frame(1, 0, 10.0, data)
    trail.callback(0, at_s + 0.001, at_s, variable, place=2)
    trail.change(What.LED, 0, 11.0, 0, RED, place=place)


def test_a_change_in_the_callback_has_its_message_for_its_cause(trail: TrailMaker) -> None:
    at_s = trail.frame(1, 0, 10.0, message(7))
    trail.change(What.LED, 0, at_s + 0.001, 0, RED, during=During.MESSAGE, heard_s=at_s)
    changed, received, _ = chain_of(trail)
    assert isinstance(changed, Changed)
    assert (changed.reads, changed.was, changed.now) == ("", b"\0", bytes([RED]))
    assert isinstance(received, Received)
    assert received.message.data == message(7)


def test_a_chain_of_three_robots_is_told_to_the_first_one(trail: TrailMaker) -> None:
    red_after(trail, message(7))
    trail.sending(1, 0, 9.9, message(7))
    trail.byte(1, 0, 9.8, 0, was=0, now=7)
    at_s = trail.frame(2, 1, 9.0, message(5))
    trail.callback(1, at_s + 0.001, at_s, HEARD, place=2)
    trail.sending(2, 1, 8.0, message(5))
    trail.byte(2, 1, 7.0, 0, was=0, now=5)
    links = chain_of(trail)
    assert [type(link) for link in links] == [
        *(Changed, Received, Changed, Received, Changed),
        Cause,
    ]
    assert [link.robot for link in links if isinstance(link, Changed)] == [0, 1, 2]
    assert cause_of(links) == Cause("alone", Station(StationKind.ROBOT, 2), 7.0)


def test_the_variable_that_the_function_names_goes_before_others(trail: TrailMaker) -> None:
    red_after(trail, message(7))
    late_s = trail.frame(2, 0, 10.5, message(9))
    trail.callback(0, late_s + 0.001, late_s, TABLE, place=2)
    changed, received = chain_of(trail)[:2]
    assert isinstance(changed, Changed)
    assert (changed.reads, changed.set_was, changed.set_now) == ("heard", 0, 1)
    assert isinstance(received, Received)
    assert received.message.sender.number == 1


def test_a_number_drawn_in_the_same_pass_goes_before_a_variable_that_is_not_named(
    trail: TrailMaker,
) -> None:
    at_s = trail.frame(1, 0, 10.0, message(7))
    trail.callback(0, at_s + 0.001, at_s, TABLE, place=2)
    trail.change(What.LED, 0, 11.0, 0, RED, place=1, drawn_s=10.999)
    assert cause_of(chain_of(trail)).kind == "draw"


@pytest.mark.parametrize(("path", "kind"), [(4, "reading"), (KnownCode.HARD, "draw")])
def test_a_reading_of_the_same_pass_is_a_cause_and_rand_hard_draws(
    trail: TrailMaker, path: int, kind: str
) -> None:
    trail.change(What.LED, 0, 11.0, 0, RED, place=1, sensed=(10.999, path, 512))
    cause = cause_of(chain_of(trail))
    assert (cause.kind, cause.place, cause.value) == (kind, f"line {path}", 512)


def test_a_reading_of_an_earlier_pass_is_none(trail: TrailMaker) -> None:
    trail.change(What.LED, 0, 11.0, 0, RED, place=1, sensed=(10.0, 4, 512))
    assert cause_of(chain_of(trail)).kind == "alone"


def test_without_a_named_variable_the_last_one_that_a_message_changed_counts(
    trail: TrailMaker,
) -> None:
    red_after(trail, message(7), variable=TABLE, place=6)
    changed = chain_of(trail)[0]
    assert isinstance(changed, Changed)
    assert changed.reads == "table"


def test_a_named_variable_counts_also_from_before_the_last_change(trail: TrailMaker) -> None:
    at_s = trail.frame(1, 0, 10.0, message(7))
    trail.callback(0, at_s + 0.001, at_s, HEARD, place=2)
    trail.change(What.LED, 0, 20.0, 0, 1, place=1)
    trail.change(What.LED, 0, 21.0, 1, RED, place=1, before_s=20.0)
    changed, received = chain_of(trail)[:2]
    assert isinstance(changed, Changed)
    assert (changed.since_s, changed.reads) == (20.0, "heard")
    assert isinstance(received, Received)


def test_what_the_runtime_keeps_of_a_message_is_no_cause(trail: TrailMaker) -> None:
    red_after(trail, message(7), variable=UNKNOWN)
    assert cause_of(chain_of(trail)).kind == "alone"


def test_a_change_in_the_first_tick_is_the_start(trail: TrailMaker) -> None:
    trail.change(What.LED, 0, 0.01, 0, RED, tick=1)
    assert cause_of(chain_of(trail)).kind == "start"


@pytest.mark.parametrize(("forgotten", "kind"), [(0, "start"), (5, "forgotten")])
@pytest.mark.parametrize("question", [LED, MOTORS, VARIABLE])
def test_what_has_never_changed_is_so_since_the_start_or_not_known(
    question: Question, forgotten: int, kind: str
) -> None:
    links = chain_of(TrailMaker(forgotten), question)
    assert [type(link) for link in links] == [Cause]
    assert cause_of(links).kind == kind


def test_a_colour_written_bit_by_bit_is_one_change(trail: TrailMaker) -> None:
    trail.change(What.LED, 0, 10.0, 5, 1, place=1, before_s=4.0)
    trail.change(What.LED, 0, 10.0001, 1, RED, place=1, before_s=10.0)
    changed = chain_of(trail)[0]
    assert isinstance(changed, Changed)
    assert (changed.was, changed.now, changed.since_s) == (bytes([5]), bytes([RED]), 4.0)


def test_a_blink_that_ends_as_it_began_is_no_change(trail: TrailMaker) -> None:
    trail.change(What.LED, 0, 9.0, 0, RED, place=1)
    trail.change(What.LED, 0, 10.0, RED, 0, place=2, before_s=9.0)
    trail.change(What.LED, 0, 10.0001, 0, RED, place=2, before_s=10.0)
    changed = chain_of(trail)[0]
    assert isinstance(changed, Changed)
    assert changed.at_s == 9.0


def test_the_kick_of_motors_is_part_of_one_change(trail: TrailMaker) -> None:
    trail.change(What.MOTORS, 0, 10.0, 0, 0xFFFF, place=1)
    trail.change(What.MOTORS, 0, 10.015, 0xFFFF, 0x4641, place=1, before_s=10.0)
    changed = chain_of(trail, MOTORS)[0]
    assert isinstance(changed, Changed)
    assert (changed.was, changed.now) == (b"\0\0", b"\x46\x41")


def test_changes_behind_the_moment_do_not_count(trail: TrailMaker) -> None:
    trail.change(What.LED, 0, 10.0, 0, 1)
    trail.change(What.LED, 0, 11.0, 1, RED, before_s=10.0)
    changed = chain_of(trail, replace(LED, at_s=10.5))[0]
    assert isinstance(changed, Changed)
    assert changed.now == b"\1"


def test_a_number_of_two_bytes_is_put_together(trail: TrailMaker) -> None:
    trail.change(What.ASKED, 0, 5.0, 0, 0x12, address=0x301, place=1)
    trail.change(What.ASKED, 0, 9.0, 0x10, 0xFF, address=0x300, place=1)
    trail.change(What.ASKED, 0, 10.0, 0xFF, 0x00, address=0x300, place=1)
    trail.change(What.ASKED, 0, 10.0001, 0x12, 0x13, address=0x301, place=1)
    changed = chain_of(trail, VARIABLE)[0]
    assert isinstance(changed, Changed)
    assert (changed.was, changed.now) == (b"\xff\x12", b"\x00\x13")


def test_the_byte_that_the_receiver_had_not_had_before_is_followed(trail: TrailMaker) -> None:
    trail.frame(1, 0, 5.0, message(1, 0, 3))
    red_after(trail, message(1, 7, 3))
    trail.sending(1, 0, 9.9, message(1, 7, 3))
    trail.byte(1, 0, 9.0, 1, was=0, now=7)
    trail.byte(1, 0, 9.5, 2, was=2, now=3)
    _, received, sender = chain_of(trail)[:3]
    assert isinstance(received, Received)
    assert received.others == 1
    assert isinstance(sender, Changed)
    assert (sender.first, sender.was, sender.now, sender.at_s) == (1, b"\0", b"\7", 9.0)


def test_bytes_that_one_line_set_are_told_together(trail: TrailMaker) -> None:
    red_after(trail, message(1, 0, 3))
    trail.sending(1, 0, 9.9, message(1, 0, 3))
    trail.byte(1, 0, 9.0, 0, was=9, now=1)
    trail.byte(1, 0, 9.0001, 2, was=8, now=3)
    sender = chain_of(trail)[2]
    assert isinstance(sender, Changed)
    assert (sender.first, sender.was, sender.now) == (0, b"\x09\0\x08", b"\1\0\3")


def test_a_message_that_never_changed_is_so_since_the_start(trail: TrailMaker) -> None:
    red_after(trail, message(1))
    trail.sending(1, 0, 0.5, message(1))
    assert cause_of(chain_of(trail)) == Cause("start", Station(StationKind.ROBOT, 1), 0.5)


def test_a_message_whose_sending_is_not_there_is_not_known(trail: TrailMaker) -> None:
    red_after(trail, message(1))
    assert cause_of(chain_of(trail)).kind == "forgotten"
    trail.sending(1, 0, 9.0, message(2))
    assert cause_of(chain_of(trail)).kind == "forgotten"


def test_a_callback_whose_message_is_not_there_is_not_known(trail: TrailMaker) -> None:
    trail.change(What.LED, 0, 10.0, 0, RED, during=During.MESSAGE, heard_s=9.9)
    assert cause_of(chain_of(trail)).kind == "forgotten"


def test_of_messages_that_ended_together_the_right_one_is_meant(trail: TrailMaker) -> None:
    for sender in (1, 2, 3):
        at_s = trail.frame(sender, 0, 10.0, message(sender))
    trail.change(What.LED, 0, 10.01, 0, RED, during=During.MESSAGE, heard_s=at_s, nth=1)
    received = chain_of(trail)[1]
    assert isinstance(received, Received)
    assert received.message.sender.number == 2


def test_depth_is_kept(trail: TrailMaker) -> None:
    red_after(trail, message(7))
    trail.sending(1, 0, 9.9, message(7))
    trail.byte(1, 0, 9.8, 0, was=0, now=7)
    assert cause_of(chain_of(trail, depth=1)).kind == "depth"
    assert cause_of(chain_of(trail, depth=2)).kind == "alone"


def test_a_robot_that_runs_natively_ends_the_chain(trail: TrailMaker) -> None:
    red_after(trail, message(7))
    assert cause_of(chain_of(trail, native=1)) == Cause(
        "native", Station(StationKind.ROBOT, 1), 10.0
    )


@pytest.mark.parametrize(
    ("kind", "cause"),
    [
        (StationKind.OVERHEAD, "overhead"),
        (StationKind.COMMAND, "command"),
        (StationKind.BEACON, "beacon"),
        (StationKind.FLOOR, "floor"),
    ],
)
def test_what_is_no_robot_is_a_first_cause(
    trail: TrailMaker, kind: StationKind, cause: str
) -> None:
    at_s = trail.frame(0, 0, 10.0, message(7), kind)
    trail.change(What.LED, 0, at_s + 0.001, 0, RED, during=During.MESSAGE, heard_s=at_s)
    assert cause_of(chain_of(trail)) == Cause(cause, Station(kind, 0), 10.0)


class TestCells:
    """Cell 5 is of module 1, with cells 4 to 7."""

    @pytest.fixture(autouse=True)
    def _red_by_a_cell(self, trail: TrailMaker) -> None:
        at_s = trail.frame(5, 0, 10.0, message(7), StationKind.CELL)
        trail.change(What.LED, 0, at_s + 0.001, 0, RED, during=During.MESSAGE, heard_s=at_s)

    def test_what_a_cell_has_always_sent_is_its_module_s(self, trail: TrailMaker) -> None:
        trail.frame(5, 0, 9.0, message(7), StationKind.CELL)
        assert cause_of(chain_of(trail)) == Cause("cell", Station(StationKind.CELL, 5), 10.0)

    def test_a_new_word_follows_from_what_its_module_received(self, trail: TrailMaker) -> None:
        trail.frame(5, 0, 8.0, message(6), StationKind.CELL)
        trail.frame(5, 1, 9.5, message(7), StationKind.CELL)
        trail.between(Station(StationKind.ROBOT, 2), Station(StationKind.CELL, 7), 9.0, message(4))
        trail.sending(2, 0, 8.9, message(4))
        links = chain_of(trail)
        assert links[2] == CellTold(5, 9.5, message(6), message(7))
        assert isinstance(links[3], Received)
        assert links[3].message.receiver == Station(StationKind.CELL, 7)
        assert cause_of(links) == Cause("start", Station(StationKind.ROBOT, 2), 8.9)

    def test_a_new_word_without_a_robot_before_is_its_module_s(self, trail: TrailMaker) -> None:
        trail.frame(5, 0, 8.0, message(6), StationKind.CELL)
        trail.between(Station(StationKind.ROBOT, 2), Station(StationKind.CELL, 8), 9.9, message(4))
        assert cause_of(chain_of(trail)) == Cause("cell", Station(StationKind.CELL, 5), 10.0)

    def test_depth_ends_a_chain_at_a_cell_too(self, trail: TrailMaker) -> None:
        trail.frame(5, 0, 8.0, message(6), StationKind.CELL)
        trail.between(Station(StationKind.ROBOT, 2), Station(StationKind.CELL, 4), 9.9, message(4))
        assert cause_of(chain_of(trail, depth=1)).kind == "depth"


def test_what_was_never_has_no_time(trail: TrailMaker) -> None:
    trail.change(What.LED, 0, 10.0, 0, RED)
    changed = chain_of(trail)[0]
    assert isinstance(changed, Changed)
    assert changed.since_s == NEVER_S
