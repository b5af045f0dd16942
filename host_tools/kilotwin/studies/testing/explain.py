"""Differences of LEDs for people."""

from typing import Any, SupportsIndex

from kilotwin.experiment.colours import LED_VALUES, led_rgb

_LISTED = 10


def leds(left: object, right: object) -> list[str] | None:
    """`RGB(1,0,0) == RGB(0,3,0)`, where one side is an LED byte, or which robots of two lists
    differ; None where the other side is neither."""
    if isinstance(left, list | tuple) and isinstance(right, list | tuple):
        return _lists(left, right)
    if not isinstance(left, SupportsIndex) or not isinstance(right, SupportsIndex):
        return None
    return [f"{_shown(left)} == {_shown(right)}", "the LED shows another colour"]


def _lists(left: "list[object] | tuple[object, ...]", right: object) -> list[str] | None:
    assert isinstance(right, list | tuple)
    if not all(isinstance(one, SupportsIndex) for one in (*left, *right)):
        return None
    head = f"LEDs of {len(left)} robots == LEDs of {len(right)} robots"
    if len(left) != len(right):
        return [head]
    differ = [
        f"robot {robot}: {_shown(one)} == {_shown(other)}"
        for robot, (one, other) in enumerate(zip(left, right, strict=True))
        if one != other
    ]
    more = [f"and {len(differ) - _LISTED} more"] if len(differ) > _LISTED else []
    return [head, *differ[:_LISTED], *more]


def _shown(value: Any) -> str:
    number = int(value)
    return "RGB({},{},{})".format(*led_rgb(number)) if 0 <= number < LED_VALUES else str(number)
