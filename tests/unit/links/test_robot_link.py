"""Answers of robots as a host reads them."""

import pytest

from kilotwin.files.headers import BOOT_IDENTITY, GAINS, VITALS
from kilotwin.table.links.robot_link import Gains, Heard, LoaderState, Report, RobotState, slot_of


def test_a_loaders_answer_names_the_pages_that_it_lacks() -> None:
    report = Report(uid=7, first=32, content=bytes([0b101, 0, 0, 0x80]), state=1)
    assert report.in_loader
    assert report.loader_state is LoaderState.LOADING
    assert report.robot_state is None
    assert report.missing == {32, 34, 63}


def test_an_answer_about_the_image_has_its_id() -> None:
    report = Report(uid=7, first=BOOT_IDENTITY, content=bytes([1, 2, 3, 4]), state=2)
    assert report.image_id == 0x04030201
    assert report.voltage is None


@pytest.mark.parametrize(("reading", "voltage"), [(0, 0), (683, 683), (1023, None)])
def test_an_applications_answer_has_voltage_and_state(reading: int, voltage: int | None) -> None:
    content = bytes([reading & 255, 0x22, 0xD6, reading >> 8 << 6 | 0x2D])
    report = Report(uid=7, first=VITALS, content=content, state=0x12)
    assert not report.in_loader
    assert report.loader_state is None
    assert report.robot_state is RobotState.RUNNING
    assert report.voltage == voltage
    assert report.heard == Heard(Gains(0x122, 0x3D6), 2)


def test_an_answer_about_tables_has_an_entry() -> None:
    report = Report(uid=7, first=GAINS + 3, content=bytes([0x01, 0x2C, 0x02, 0x9B]), state=0x56)
    assert report.entry == Gains(0x012C, 0x029B)
    assert report.robot_state is RobotState.MOVING
    assert not report.is_late


def test_an_answer_to_another_question_is_late() -> None:
    for state, late in ((0x16, True), (0x26, False), (0x36, True), (0x02, False)):
        assert Report(uid=7, first=GAINS, content=bytes(4), state=state).is_late == late


@pytest.mark.parametrize("state", [4, 15, 0x17, 0x2F])
def test_a_state_that_is_none_is_read_as_none(state: int) -> None:
    report = Report(uid=7, first=VITALS, content=bytes(4), state=state)
    assert report.loader_state is None
    assert report.robot_state is None


def test_slots_are_spread_and_change_with_the_nonce() -> None:
    slots = [slot_of(uid, 3, 8) for uid in range(1, 51)]
    assert all(0 <= slot < 256 for slot in slots)
    assert len(set(slots)) > 40
    assert slots != [slot_of(uid, 4, 8) for uid in range(1, 51)]
    assert {slot_of(uid, 3, 0) for uid in range(50)} == {0}
