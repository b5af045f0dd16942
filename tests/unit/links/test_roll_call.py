"""Robots' answers, and the table of them."""

from collections.abc import Sequence

import pytest

from kilotwin.files.flash_image import FlashImage
from kilotwin.files.headers import ALL_ROBOTS, VITALS
from kilotwin.table.links.robot_link import Report
from kilotwin.table.links.roll_call import RollCall, colour_of, colours, state_of, volts


def vitals(uid: int, reading: int = 700, state: int = 0x12) -> Report:
    content = bytes([reading & 255, 0, 0, reading >> 8 << 6])
    return Report(uid, VITALS, content, state, module=(3, 4), cell=1)


class Link:
    """Robots that answer one question after the other as it is written."""

    name, verifies, laps_per_place = "written", True, 1

    def __init__(self, answers: Sequence[list[Report]]) -> None:
        self.answers = list(answers)
        self.asked: list[tuple[int, int, int]] = []

    def ask(self, first: int, slots_log2: int, nonce: int, uid: int = ALL_ROBOTS) -> list[Report]:
        self.asked.append((first, slots_log2, nonce))
        return self.answers.pop(0) if self.answers else []

    def repeat(self, message: bytes, hold_s: float) -> None:
        raise AssertionError(message)

    def announce(self, image: FlashImage) -> None:
        raise AssertionError(image)

    def send_page(self, page: int, data: bytes) -> None:
        raise AssertionError(page)

    def close(self) -> None:
        pass


def test_robots_are_asked_until_no_new_one_answers() -> None:
    link = Link([[vitals(2)], [], [vitals(1), vitals(2)], [], []])
    roll_call = RollCall(link)
    roll_call.ask_until(2)
    assert sorted(roll_call.robots) == [1, 2]
    assert len(link.asked) == 5
    assert {first for first, _, _ in link.asked} == {VITALS}
    assert len({nonce for _, _, nonce in link.asked}) == 5


def test_with_all_that_are_expected_it_is_enough() -> None:
    link = Link([[vitals(2)], [vitals(1)], [vitals(3)]])
    RollCall(link).ask_until(4, expected=2)
    assert len(link.asked) == 2


def test_more_robots_get_more_slots() -> None:
    link = Link([[vitals(uid) for uid in range(1, 101)], []])
    RollCall(link).ask_until(1)
    assert [slots for _, slots, _ in link.asked] == [6, 8]


def test_the_table_has_volts_and_the_reading_they_come_from() -> None:
    link = Link([[vitals(12, 683), vitals(3, 0x3FF), vitals(ALL_ROBOTS, 600, 0x10)]])
    roll_call = RollCall(link)
    roll_call.ask()
    assert roll_call.text().splitlines() == [
        "  uid  module  cell  volts  reading  state",
        "    3     3-4     1                  running",
        "   12     3-4     1   4.00      683  running, green",
        "65535     3-4     1   3.52      600  idle, red",
        "3 robots answer",
        "robots without a uid answer as 65535, and cannot be told apart",
    ]
    assert roll_call.as_list()[1] == {
        "uid": 12,
        "module": [3, 4],
        "cell": 1,
        "reading": 683,
        "volts": 4.0,
        "state": "running",
    }
    assert roll_call.as_list()[0]["volts"] is None


@pytest.mark.parametrize(
    ("reading", "colour"),
    [(683, "green"), (682, "blue"), (649, "blue"), (648, "yellow"), (614, "red"), (0, "red")],
)
def test_colours_change_where_the_robots_do(reading: int, colour: str) -> None:
    assert colour_of(reading) == colour


def test_volts_are_those_of_the_thresholds() -> None:
    assert round(volts(682), 1) == 4.0
    assert colours() == ("green above 4.0 V, blue above 3.8 V, yellow above 3.6 V, red: charge it")


@pytest.mark.parametrize(
    ("state", "word"),
    [(0, "no program"), (1, "loading"), (2, "complete"), (3, "CRC wrong"), (9, "unknown state 9")],
)
def test_loaders_have_states_of_their_own(state: int, word: str) -> None:
    assert word in state_of(vitals(1, state=state))
    link = Link([[Report(1, VITALS, bytes(4), state)]])
    roll_call = RollCall(link)
    roll_call.ask()
    assert roll_call.text().splitlines()[1].split()[:2] == [
        "1",
        state_of(vitals(1, state=state)).split()[0],
    ]
