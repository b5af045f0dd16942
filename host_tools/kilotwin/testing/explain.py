"""Differences of LEDs for people."""

from typing import SupportsIndex

from kilotwin.experiment.colours import LED_VALUES, led_rgb


def leds(left: object, right: object) -> list[str] | None:
    """`RGB(1,0,0) == RGB(0,3,0)`, where one side is an LED byte; None where the other is none."""
    if not isinstance(left, SupportsIndex) or not isinstance(right, SupportsIndex):
        return None
    return [f"{_shown(left)} == {_shown(right)}", "the LED shows another colour"]


def _shown(value: SupportsIndex) -> str:
    number = int(value)
    return "RGB({},{},{})".format(*led_rgb(number)) if 0 <= number < LED_VALUES else str(number)
