"""A robot calibrated by keys: it moves at once, and saves when it is told."""

import pytest

from kilotwin.experiment.spec.overhead import CALIB_MARK
from kilotwin.table.lab.by_hand import ByHand, save

from .fake_table import FakeTable


@pytest.fixture
def table() -> FakeTable:
    return FakeTable(4, 6, 2)


@pytest.mark.parametrize(
    ("keys", "duties", "motors"),
    [
        ("q", (66, 65, 70, 70), (66, 0)),
        ("aa", (63, 65, 70, 70), (63, 0)),
        ("w", (65, 66, 70, 70), (0, 66)),
        ("s", (65, 64, 70, 70), (0, 64)),
        ("ee", (65, 65, 72, 70), (72, 70)),
        ("dr", (65, 65, 69, 71), (69, 71)),
        ("f", (65, 65, 70, 69), (70, 69)),
        ("1", (65, 65, 70, 70), (65, 0)),
        ("2", (65, 65, 70, 70), (0, 65)),
        ("3 ", (65, 65, 70, 70), (0, 0)),
    ],
)
def test_a_key_changes_a_duty_and_the_robot_moves(
    table: FakeTable, keys: str, duties: tuple[int, ...], motors: tuple[int, int]
) -> None:
    dialog = ByHand(table, 2, (65, 65, 70, 70))
    assert all(dialog.press(key) for key in keys)
    assert tuple(dialog.duties.values()) == duties
    assert tuple(table.motors[1]) == motors
    assert tuple(table.motors[0]) == (0, 0)
    assert not dialog.saved


def test_saving_is_for_this_robot_and_ends_with_a_change(table: FakeTable) -> None:
    dialog = ByHand(table, 2, (65, 65, 70, 70))
    for key in "eS":
        dialog.press(key)
    assert dialog.saved
    assert tuple(table.saved[1]) == (65, 65, 71, 70)
    assert tuple(table.saved[0]) == (255, 255, 255, 255)
    assert "straight left 71" in dialog.line()
    dialog.press("d")
    assert not dialog.saved


def test_duties_stay_within_a_byte(table: FakeTable) -> None:
    dialog = ByHand(table, 1, (0, 255, 70, 70))
    for key in "aw":
        dialog.press(key)
    assert (dialog.duties["turn_left"], dialog.duties["turn_right"]) == (0, 255)


def test_leaving_stops_the_robot(table: FakeTable) -> None:
    dialog = ByHand(table, 1, (65, 65, 70, 70))
    dialog.press("3")
    dialog.press("x")
    assert dialog.over
    assert tuple(table.motors[0]) == (0, 0)


def test_a_key_without_a_meaning_does_nothing(table: FakeTable) -> None:
    dialog = ByHand(table, 1, (65, 65, 70, 70))
    assert not dialog.press("z")
    assert table.now == 0


class Recorder(FakeTable):
    """Keeps the messages."""

    def __init__(self) -> None:
        super().__init__(4, 6, 1)
        self.sent: list[bytes] = []

    def repeat(self, message: bytes, hold_s: float) -> None:
        self.sent.append(message)


def test_a_new_uid_goes_to_the_one_robot_in_a_trial() -> None:
    link = Recorder()
    save(link, 65535, (65, 66, 70, 71), 12)
    wakeup, trial, saving = link.sent
    assert wakeup == bytes(9) + b"\x85"
    assert trial == b"\x01\xff\xff\x41\x42\x46\x47" + CALIB_MARK + b"\x8a"
    assert saving == b"\x00\x0c\x00\x41\x42\x46\x47\x00\x00\x8a"
