"""The output of avrdude, understood: how far it came, and why it failed."""

from pathlib import Path

import pytest

from kilotwin.errors import DeviceError, InputError, KilotwinError, RunError
from kilotwin.table.flash.avrdude import SignsOfLife, Wiring

WIRING = Wiring("stk500v2", "usb", ("-B", "20"))
BEGAN = "avrdude: AVR device initialized and ready to accept instructions\n"


def signs_of(text: str) -> SignsOfLife:
    """Taken in pieces, as they come."""
    signs = SignsOfLife()
    for i in range(0, len(text), 7):
        signs.take(text[i : i + 7])
    return signs


def test_the_command_can_be_typed() -> None:
    assert WIRING.shown("m328p") == "avrdude -p m328p -c stk500v2 -P usb -B 20"


def test_marks_of_its_bar_are_the_share_that_is_done() -> None:
    signs = SignsOfLife()
    assert signs.take("avrdude: writing 100 bytes flash ...\n\nWriting | ") == 0
    assert signs.take("#" * 25) == 0.5
    assert signs.take("#" * 25) == 1
    assert signs.take(" | 100% 0.04s\n") is None


def test_it_is_known_how_far_it_came() -> None:
    signs = signs_of(BEGAN)
    assert (signs.began, signs.erased, signs.verified) == (True, False, False)
    signs = signs_of(BEGAN + "avrdude: erasing chip\n")
    assert (signs.began, signs.erased, signs.verified) == (True, True, False)
    signs.take("avrdude: 416 bytes of flash verified\n")
    assert signs.verified


def test_one_that_never_answered_is_given_up_sooner_than_one_that_did() -> None:
    assert not signs_of("").hopeless
    assert signs_of("avrdude error: timeout\n").hopeless
    assert not signs_of(BEGAN + "avrdude error: timeout\n").hopeless
    assert signs_of(BEGAN + "avrdude error: timeout\n" * 2).hopeless


@pytest.mark.parametrize(
    ("text", "kind", "said"),
    [
        ("avrdude error: cannot find programmer id x\n", InputError, "knows no such programmer"),
        ("avrdude OS error: cannot open port x: No such file\n", DeviceError, "no programmer"),
        ("avrdude error: unable to open programmer x on port usb\n", DeviceError, "no programmer"),
        ("avrdude error: initialization failed, rc=-1\n", DeviceError, "but no chip does"),
        (BEGAN + "avrdude error: Yikes!  Invalid device signature.\n", DeviceError, "but no chip"),
        (BEGAN + "avrdude error: verification mismatch\n", RunError, "is not what was written"),
        ("avrdude error: timeout\n", DeviceError, "nothing at usb answers as a stk500v2"),
        (BEGAN + "avrdude error: timeout\n" * 2, DeviceError, "the programmer at usb is gone"),
        (BEGAN + "avrdude error: what is this?\n", RunError, "avrdude failed"),
    ],
)
def test_why_it_failed_is_one_line(text: str, kind: type[KilotwinError], said: str) -> None:
    error = signs_of(text).error(WIRING)
    assert type(error) is kind
    assert said in str(error)
    assert "\n" not in str(error)


def test_a_port_that_has_gone_explains_any_failure(tmp_path: Path) -> None:
    wiring = Wiring("stk500v2", str(tmp_path / "gone"))
    assert "is gone" in str(signs_of(BEGAN + "avrdude error: odd\n").error(wiring))


def test_avrdudes_own_words_come_below_a_line_that_says_too_little() -> None:
    error = signs_of(BEGAN + "\n".join(f"line {i}" for i in range(20)) + "\n").error(WIRING)
    assert error.detail == "\n".join(f"line {i}" for i in range(12, 20))
