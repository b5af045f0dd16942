"""The light on the table as a picture, from the readings of robots' sensors.

As emulator/physics/light.h has it, but without the shadows of walls that block light.
"""

import contextlib
from typing import Any

import numpy as np

from kilotwin.errors import InputError
from kilotwin.experiment.areas import area_of, inside
from kilotwin.experiment.pictures import light_picture
from kilotwin.runs.pixels import as_png
from kilotwin.runs.reader import Run

_PIXELS = 160  # of the longer side
_BRIGHTEST = 1023
_COLOUR = (255, 208, 0)
_MOST_COVER = 200  # of 255


def light_of(run: Run) -> dict[str, Any] | None:
    """`box` in metres and `png`, the brighter the yellower; None where it is the same everywhere,
    or its picture is there no more."""
    light = run.experiment.light
    if not light.source and light.picture is None:
        return None
    arena = area_of(run.experiment.arena)
    step = max(arena.width, arena.height) / _PIXELS
    columns, rows = round(arena.width / step), round(arena.height / step)
    low = (arena.x - arena.width / 2, arena.y - arena.height / 2)
    x, y = np.meshgrid(
        low[0] + (np.arange(columns) + 0.5) * arena.width / columns,
        low[1] + (np.arange(rows) + 0.5) * arena.height / rows,
    )
    reading = np.full(x.shape, light.ambient)
    for source in light.source:
        away = (x - source.at_m[0]) ** 2 + (y - source.at_m[1]) ** 2
        reading += source.peak / (1 + away / source.half_m**2)
    if light.picture is not None:
        with contextlib.suppress(InputError):
            picture = light_picture(run.experiment, run.origin)
            assert picture is not None
            reading += light.picture.white * picture.at(x, y) / 255
    pixels = np.zeros((*x.shape, 4), dtype=np.uint8)
    pixels[..., :3] = _COLOUR
    share = np.clip(reading / _BRIGHTEST, 0, 1)
    pixels[..., 3] = np.round(_MOST_COVER * np.sqrt(share)) * inside(arena, x, y)
    box = [low[0], low[1], low[0] + arena.width, low[1] + arena.height]
    return {"box": box, "png": as_png(pixels)}
