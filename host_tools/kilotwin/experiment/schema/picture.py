"""Tables of an experiment file about pictures: of the floor's sites, and of light on it."""

import re
from typing import Annotated

from pydantic import AfterValidator, Field

from kilotwin.experiment.schema.section import Length, Point, Reading10, Section, Text

_COLOUR = re.compile(r"#[0-9a-f]{6}")


def _is_colour(text: str) -> str:
    if not _COLOUR.fullmatch(text):
        raise ValueError("is no colour of a legend; write it as #rrggbb, in small letters")
    return text


Colour = Annotated[str, AfterValidator(_is_colour)]


class FloorTable(Section):
    """Sites that are drawn as a picture: each colour of its legend is a site."""

    image: Text
    """A picture, as a PNG without smoothed edges. Its sites lie where no other site is."""
    width_m: Length
    """Its width on the floor; its height follows, pixels are square."""
    centre_m: Point = [0.0, 0.0]
    """Its middle, [x, y]."""
    legend: Annotated[dict[Colour, Annotated[str, Field(max_length=200)]], Field(min_length=1)]
    """Names of sites by colour, as "#d62728" = "nest"; "" for floor without a site."""


class LightPicture(Section):
    """Light that a projector throws, as a picture: added to lamps and `ambient`."""

    image: Text
    """A picture; its brightness counts, black adds nothing. Outside it is dark."""
    width_m: Length
    """Its width on the floor; its height follows, pixels are square."""
    centre_m: Point = [0.0, 0.0]
    """Its middle, [x, y]."""
    white: Annotated[Reading10, Field(gt=0)] = 1023.0
    """The reading that white adds."""
