"""Answers of robots as a host reads them."""

import pytest

from kilotwin.files.headers import BOOT_IDENTITY, VITALS
from kilotwin.links.robot_link import LoaderState, Report, RobotState, slot_of


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


@pytest.mark.parametrize(("reading", "voltage"), [(0, 0), (683, 683), (0xFFFF, None)])
def test_an_applications_answer_has_voltage_and_state(reading: int, voltage: int | None) -> None:
    content = reading.to_bytes(2, "little") + bytes(2)
    report = Report(uid=7, first=VITALS, content=content, state=0x12)
    assert not report.in_loader
    assert report.loader_state is None
    assert report.robot_state is RobotState.RUNNING
    assert report.voltage == voltage


@pytest.mark.parametrize("state", [4, 15, 0x17, 255])
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
