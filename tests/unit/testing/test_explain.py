"""Differences of LEDs are told by their colours."""

import numpy as np

from kilotwin import RGB
from kilotwin.studies.testing.explain import leds
from kilotwin.studies.testing.plugin import pytest_assertrepr_compare

RED, GREEN = RGB(1, 0, 0), RGB(0, 3, 0)


def test_two_leds_are_told_by_their_colours() -> None:
    assert leds(np.uint8(1), GREEN) == ["RGB(1,0,0) == RGB(0,3,0)", "the LED shows another colour"]
    assert leds(300, GREEN) == ["300 == RGB(0,3,0)", "the LED shows another colour"]
    assert repr(GREEN) == "RGB(0, 3, 0)"


def test_of_lists_the_robots_that_differ_are_told() -> None:
    assert leds([1, 1, 12], [RED, GREEN, GREEN]) == [
        "LEDs of 3 robots == LEDs of 3 robots",
        "robot 1: RGB(1,0,0) == RGB(0,3,0)",
    ]
    assert leds([1], [RED, RED]) == ["LEDs of 1 robots == LEDs of 2 robots"]
    many = leds([1] * 20, [GREEN] * 20)
    assert many is not None
    assert many[-1] == "and 10 more"


def test_what_is_no_led_is_left_to_pytest() -> None:
    assert leds("red", RED) is None
    assert leds(["red"], [RED]) is None
    assert pytest_assertrepr_compare("==", [1, 2], [1, 3]) is None
    assert pytest_assertrepr_compare("<", RED, GREEN) is None
    assert pytest_assertrepr_compare("==", [1], [GREEN]) is not None
