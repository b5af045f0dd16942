"""The common part of files for other viewers: robots sample by sample, outlines, colours."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kilotwin.errors import InputError
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.runs.reader import Run
from kilotwin.runs.samples import RunSamples
from kilotwin.runs.scene import scene_of

_ROWS_AT_ONCE = 200_000
_CORNERS = 64


@dataclass(frozen=True)
class Moment:
    """Robots that were recorded at a sample. `led` are colours, [robots, 3]."""

    time_s: float
    places: NDArray[np.float32]  # [robots, 2], m
    heading_rad: NDArray[np.float64] | None
    colours: NDArray[np.uint8]


@dataclass(frozen=True)
class Outline:
    """A closed line on the table: its corners, [n, 2], m, and its colour."""

    name: str
    corners: NDArray[np.float64]
    colour: tuple[int, int, int]


class MovingRobots:
    """A run with places; InputError without."""

    def __init__(self, run: Run) -> None:
        run.need("x_m", "y_m")
        self._samples = RunSamples.of(run)
        if not self._samples.samples:
            raise InputError(f"{run.folder}: no sample was recorded; let the run go on for longer")
        self._scene = scene_of(run)
        self._leds = np.array([_rgb(colour) for colour in self._scene["leds"]], dtype=np.uint8)
        self.radius_m = PROFILES[run.experiment.swarm.profile].radius_m
        self.number = self._samples.samples

    def moments(self) -> Iterator[Moment]:
        """Each sample."""
        times = self._samples.times_s()
        step = max(1, _ROWS_AT_ONCE // max(1, len(self._samples.robots.ids)))
        for first in range(0, self.number, step):
            wanted = range(first, min(first + step, self.number))
            read = self._samples.read(wanted)
            for place, number in enumerate(wanted):
                yield self._moment(float(times[number]), read, place)

    def _moment(self, time_s: float, read: dict[str, NDArray[Any]], place: int) -> Moment:
        places = np.column_stack([read["x_m"][place], read["y_m"][place]])
        known = np.isfinite(places).all(axis=1)
        led = read["led"][place] if "led" in read else np.zeros(len(places), dtype=np.uint8)
        turns = read["heading_rad"][place][known] if "heading_rad" in read else None
        return Moment(
            time_s,
            places[known],
            None if turns is None else turns * (2 * np.pi / 65536),
            self._leds[led[known] & 63],
        )

    def outlines(self) -> list[Outline]:
        """Arena, sites and obstacles; a site that is drawn in a picture has none."""
        scene = self._scene
        made = [Outline("arena", _corners(scene["arena"]), (64, 64, 64))]
        for site in scene["sites"]:
            if "circle" in site or "polygon" in site:
                name = f"site {site['name']}"
                made.append(Outline(name, _corners(site), _rgb(site["colour"])))
        for number, shape in enumerate(scene["obstacles"]):
            made.append(Outline(f"obstacle {number}", _corners(shape), (110, 90, 74)))
        return made


def _rgb(colour: str) -> tuple[int, int, int]:
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def _corners(shape: dict[str, Any]) -> NDArray[np.float64]:
    if "circle" not in shape:
        return np.array(shape["polygon"], dtype=np.float64)
    x, y, radius = shape["circle"]
    angles = np.linspace(0, 2 * np.pi, _CORNERS, endpoint=False)
    return np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles)])
