"""Colours of figures and of the viewer, which colour-blind people can distinguish."""

import re

from kilotwin.experiment.colours import SITE_COLOURS, SITE_PALETTE, site_colour
from kilotwin.experiment.schema.experiment import ExperimentSchema

FLOOR = "#b9b9b9"
OUTLINE = "#404040"
OBSTACLE = "#6e5a4a"
OBJECT = "#e5d8bd"

# Okabe and Ito's colours; they stand out on black, grey and white alike.
STATE_COLOURS = {
    "walking": "#0072b2",
    "entering": "#f0e442",
    "resting": "#e69f00",
    "leaving": "#009e73",
    "avoiding": "#d55e00",
}
OTHER_STATES = ["#cc79a7", "#56b4e9", "#8c564b", "#7b3fa0", "#999933", "#44aa99"]


def site_fills(experiment: ExperimentSchema) -> list[str]:
    """Each site's colour: its own, else its name if that is one, else from a palette."""
    return [
        name_fill(site.name, index) if site.colour is None else site_colour(site.colour)
        for index, site in enumerate(experiment.site)
    ]


def name_fill(name: str, index: int) -> str:
    """The colour of the site with that name, which is number `index` from 0."""
    return SITE_COLOURS.get(name.lower(), SITE_PALETTE[index % len(SITE_PALETTE)])


def state_colours(states: list[str]) -> dict[str, str]:
    """A colour for each state that occurs; plain LED colours show as themselves."""
    others = iter(OTHER_STATES * (len(states) // len(OTHER_STATES) + 1))
    return {
        state: STATE_COLOURS.get(state) or _led_colour(state) or next(others) for state in states
    }


def _led_colour(state: str) -> str | None:
    """`RGB(1,0,3)`, the name of a colour without a meaning, as #rrggbb."""
    plain = re.fullmatch(r"RGB\((\d),(\d),(\d)\)", state)
    return plain and "#" + "".join(f"{85 * int(level):02x}" for level in plain.groups())
