"""The tables of an experiment file about a virtual environment: program, camera, controllers."""

from typing import Annotated, Any

from pydantic import AfterValidator, Field

from kilotwin.experiment.schema.metric import Region
from kilotwin.experiment.schema.section import Section, Share, Text
from kilotwin.units import TICK_S

_PLAIN = (bool, int, float, str)


def _plain(value: Any) -> Any:
    """Values that TOML and JSON both have; ValueError for dates and times."""
    if isinstance(value, dict | list):
        for part in value.values() if isinstance(value, dict) else value:
            _plain(part)
    elif not isinstance(value, _PLAIN):
        raise ValueError("has a date or a time; write numbers, texts, lists and tables")
    return value


class EnvironmentTable(Section):
    """A program that sees robots by a camera and tells them by the overhead controller."""

    program: Text
    """A class in a file: "pheromone.py:Pheromone"; see docs/environment.md."""
    settings: Annotated[dict[str, Any], AfterValidator(_plain)] = {}
    """The program's own keys, passed to it unchanged: [environment.settings]."""
    picture_hz: Annotated[float, Field(gt=0, le=1 / TICK_S)] = 10.0
    """Pictures per second. ARK: one each 100 ms (hardware.md 1.13)."""
    delay_s: Annotated[float, Field(ge=0, le=10)] = 0.1
    """From a picture until the program gets it. A guess."""
    position_noise_m: Annotated[float, Field(ge=0, le=0.1)] = 0.001
    """Error of a position, along x and along y: standard deviation. A guess."""
    heading_noise_rad: Annotated[float, Field(ge=0, le=3.2)] = 0.1
    """Error of a heading: standard deviation. A guess."""
    missed: Share = 0.01
    """Share of robots not found in a picture. A guess."""
    word_bits: Annotated[
        list[Annotated[int, Field(ge=0, le=24)]], Field(min_length=3, max_length=3)
    ] = [10, 4, 10]
    """Bits of a word's uid, type and value, highest first, 24 in all; older programs for ARK have
    other ones, as [8, 4, 12] or [8, 0, 16]."""
    message_s: Annotated[float, Field(ge=0.035, le=1)] = 0.05
    """How long the overhead controller transmits a message, with words for three robots. ARK: 50
    ms; a packet takes 34 ms on its line (hardware.md 1.13)."""


class OverheadController(Region):
    """An overhead controller, by what its light reaches. Without any there is one, over all robots.

    Robots hear those that cover them where they are. What two of them send at the same time is lost
    to robots that both cover, with the medium `kilobot`; `ideal` loses nothing.
    """
