"""Colours by name: of sites, for pictures, and of the robots' LED."""

import re

SITE_COLOURS = {
    "black": "#000000",
    "white": "#ffffff",
    "red": "#d62728",
    "green": "#2ca02c",
    "blue": "#1f5fbf",
    "yellow": "#f0e442",
    "orange": "#e69f00",
    "purple": "#7b3fa0",
    "pink": "#f4a6c8",
    "brown": "#8c564b",
    "cyan": "#56b4e9",
    "magenta": "#cc3399",
}
# For sites without a colour, in order; distinct for colour-blind people too.
SITE_PALETTE = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442"]

_HEX = re.compile(r"#[0-9a-fA-F]{6}")

_LED_HUES = {
    "red": (1, 0, 0),
    "green": (0, 1, 0),
    "blue": (0, 0, 1),
    "yellow": (1, 1, 0),
    "cyan": (0, 1, 1),
    "magenta": (1, 0, 1),
    "white": (1, 1, 1),
}
LED_COLOURS = {
    "off": (0, 0, 0),
    **_LED_HUES,
    **{f"bright-{name}": (3 * r, 3 * g, 3 * b) for name, (r, g, b) in _LED_HUES.items()},
}
"""Plain names are intensity 1 of 3, as RGB(1, 0, 0) for red; `bright-` ones are 3."""

LED_VALUES = 64


def site_colour(text: str) -> str:
    """The #rrggbb of a colour's name or of a #rrggbb; ValueError lists what is allowed."""
    if text in SITE_COLOURS:
        return SITE_COLOURS[text]
    if _HEX.fullmatch(text):
        return text.lower()
    raise ValueError(f"is not a colour; allowed: #rrggbb or {', '.join(SITE_COLOURS)}")


def led_triple(colour: object) -> list[int]:
    """[red, green, blue], 0..3 each, of an LED colour's name or of such a list."""
    if isinstance(colour, str) and colour in LED_COLOURS:
        return list(LED_COLOURS[colour])
    if (
        isinstance(colour, list)
        and len(colour) == 3
        and all(type(part) is int and 0 <= part <= 3 for part in colour)
    ):
        return colour
    allowed = ", ".join(LED_COLOURS)
    raise ValueError(f"is not an LED colour; allowed: [r, g, b] with 0 to 3 each, or {allowed}")


def led_byte(red: int, green: int, blue: int) -> int:
    """The byte of the Kilobot API's RGB(red, green, blue)."""
    return red | green << 2 | blue << 4


def led_rgb(led: int) -> tuple[int, int, int]:
    """The three intensities of an LED byte."""
    return led & 3, led >> 2 & 3, led >> 4 & 3


class Led(int):
    """An LED byte that shows itself as programs write it."""

    def __repr__(self) -> str:
        return "RGB({}, {}, {})".format(*led_rgb(self))
