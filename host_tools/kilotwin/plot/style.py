"""The look of all figures: sizes, type, and colours that colour-blind people can tell apart."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from kilotwin.colours import SITE_COLOURS, SITE_PALETTE, site_colour
from kilotwin.drafts import draft_of
from kilotwin.experiment_schema import ExperimentSchema
from kilotwin.run_reader import Run

FLOOR = "#b9b9b9"
OUTLINE = "#404040"

# Okabe and Ito's colours; they stand out on black, grey and white alike.
STATE_COLOURS = {
    "walking": "#0072b2",
    "entering": "#f0e442",
    "resting": "#e69f00",
    "leaving": "#009e73",
    "avoiding": "#d55e00",
}
OTHER_STATES = ["#cc79a7", "#56b4e9", "#8c564b", "#7b3fa0", "#999933", "#44aa99"]

_SETTINGS: dict[Any, Any] = {
    "figure.dpi": 150,
    "savefig.dpi": 200,
    "font.size": 11,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 12,
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "svg.hashsalt": "kilotwin",
    "pdf.fonttype": 42,
}


def draw(drawing: Callable[[], Figure]) -> Figure:
    """Draws in our style, whatever the user's matplotlib settings."""
    with mpl.rc_context(_SETTINGS):
        return drawing()


def save(figure: Figure, target: Path) -> None:
    """Writes the picture without the time of day, so that the same run gives the same file."""
    suffix = target.suffix.lower()
    undated = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}, ".png": {}}[suffix]
    with mpl.rc_context(_SETTINGS), draft_of(target) as draft:
        figure.savefig(draft, format=suffix[1:], metadata=undated, bbox_inches="tight")


def site_fills(experiment: ExperimentSchema) -> list[str]:
    """Each site's colour: its own, else its name if that is one, else from a palette."""
    fills = []
    for index, site in enumerate(experiment.site):
        if site.colour is not None:
            fills.append(site_colour(site.colour))
        else:
            fills.append(
                SITE_COLOURS.get(site.name.lower(), SITE_PALETTE[index % len(SITE_PALETTE)])
            )
    return fills


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


def title(run: Run) -> str:
    """Which run this is, for the top of a figure."""
    return f"{run.experiment.name}, seed {run.experiment.seed}"
