"""Pictures of the floor and of light, read from their files."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kilotwin.errors import InputError, cause_of
from kilotwin.experiment.areas import area_of, inside
from kilotwin.experiment.files import find_file, shown
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.picture import FloorTable, LightPicture
from kilotwin.experiment.text import ExperimentText
from kilotwin.experiment.toml_lines import KeyPath

if TYPE_CHECKING:
    from PIL import Image

_MOST_PIXELS = 16_000_000
_OPAQUE = 255

Pixels = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Picture:
    """A byte for each pixel, the lowest row first; (0, 0) of `low_m` is its lower left corner."""

    file: Path
    values: Pixels
    low_m: tuple[float, float]
    pixel_m: float

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height."""
        rows, columns = self.values.shape
        return columns * self.pixel_m, rows * self.pixel_m

    def at(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> Pixels:
        """The values at points, 0 outside."""
        rows, columns = self.values.shape
        across = np.floor((x - self.low_m[0]) / self.pixel_m).astype(np.int64)
        up = np.floor((y - self.low_m[1]) / self.pixel_m).astype(np.int64)
        within = (across >= 0) & (across < columns) & (up >= 0) & (up < rows)
        across, up = np.clip(across, 0, columns - 1), np.clip(up, 0, rows - 1)
        found: Pixels = np.where(within, self.values[up, across], 0).astype(np.uint8)
        return found

    def spec(self) -> dict[str, Any]:
        """As the engine takes it."""
        return {
            "values": self.values.tobytes(),
            "columns": self.values.shape[1],
            "low_m": list(self.low_m),
            "pixel_m": self.pixel_m,
        }


def floor_picture(keys: ExperimentSchema, origin: ExperimentText) -> Picture | None:
    """The numbers of the sites that are drawn; None without a [floor].

    InputError names the pixel and its colour, if the legend has it not, or another site is there.
    """
    if keys.floor is None:
        return None
    file = find_file(keys.floor.image, ("floor", "image"), origin)
    colours = np.asarray(_image(file, origin, ("floor", "image")).convert("RGBA"))
    numbers = _numbers(keys, keys.floor, colours, shown(file), origin)
    picture = _placed(file, np.ascontiguousarray(numbers[::-1]), keys.floor)
    _check_places(keys, picture, origin)
    return picture


def light_picture(keys: ExperimentSchema, origin: ExperimentText) -> Picture | None:
    """The brightness of a [light.picture]; None without one."""
    if keys.light.picture is None:
        return None
    path = ("light", "picture", "image")
    file = find_file(keys.light.picture.image, path, origin)
    grey = np.asarray(_image(file, origin, path).convert("L"))
    return _placed(file, np.ascontiguousarray(grey[::-1]), keys.light.picture)


def _image(file: Path, origin: ExperimentText, path: KeyPath) -> "Image.Image":
    # Few experiments have a picture.
    from PIL import Image, UnidentifiedImageError

    try:
        image = Image.open(file)
        if image.width * image.height > _MOST_PIXELS:
            what = f"{image.width} x {image.height} pixels; take {_MOST_PIXELS:,} at most"
            raise InputError(f"{origin.where(path)}: {shown(file)} has {what}")
        image.load()
    except UnidentifiedImageError:
        raise InputError(f"{origin.where(path)}: {shown(file)} is no picture; take a PNG") from None
    except (OSError, SyntaxError, ValueError) as error:
        reason = cause_of(error) if isinstance(error, OSError) else str(error)
        what = f"{shown(file)} cannot be read: {reason}; take a PNG"
        raise InputError(f"{origin.where(path)}: {what}") from None
    return image


def _placed(file: Path, values: Pixels, table: FloorTable | LightPicture) -> Picture:
    rows, columns = values.shape
    pixel_m = table.width_m / columns
    x, y = table.centre_m
    return Picture(file, values, (x - table.width_m / 2, y - rows * pixel_m / 2), pixel_m)


def _numbers(
    keys: ExperimentSchema,
    floor: FloorTable,
    colours: Pixels,
    file: Path,
    origin: ExperimentText,
) -> Pixels:
    """Each pixel's site, rows as in the file. What is quite transparent is no site's."""
    number_of = {site.name: number for number, site in enumerate(keys.site, 1)} | {"": 0}
    packed = colours.astype(np.uint32) @ np.array([1 << 24, 1 << 16, 1 << 8, 1], dtype=np.uint32)
    numbers = np.zeros(packed.shape, dtype=np.uint8)
    known = colours[..., 3] == 0
    for colour, name in floor.legend.items():
        these = packed == (int(colour[1:], 16) << 8 | _OPAQUE)
        if not these.any():
            what = f"no pixel of {file} is {colour}; draw it, or take it out of the legend"
            raise InputError(f"{origin.where(('floor', 'legend', colour))}: {what}")
        numbers[these] = number_of[name]
        known |= these
    if not known.all():
        row, column = (int(part) for part in np.argwhere(~known)[0])
        *rgb, alpha = (int(part) for part in colours[row, column])
        colour = "#" + "".join(f"{part:02x}" for part in rgb)
        through = "" if alpha == _OPAQUE else f", transparent by {1 - alpha / _OPAQUE:.0%}"
        what = (
            f"pixel ({column}, {row}) of {file} is {colour}{through}, which the legend has not "
            f'({", ".join(floor.legend)}); add "{colour}" = "..." to [floor.legend], or draw '
            "without smoothed edges"
        )
        raise InputError(f"{origin.where(('floor', 'legend'))}: {what}")
    return numbers


def _check_places(keys: ExperimentSchema, picture: Picture, origin: ExperimentText) -> None:
    rows, columns = picture.values.shape
    x, y = np.meshgrid(
        picture.low_m[0] + (np.arange(columns) + 0.5) * picture.pixel_m,
        picture.low_m[1] + (np.arange(rows) + 0.5) * picture.pixel_m,
    )
    for index, site in enumerate(keys.site):
        if site.shape == "picture":
            continue
        both = (picture.values > 0) & inside(area_of(site), x, y)
        if both.any():
            row, column = (int(part) for part in np.argwhere(both)[0])
            drawn = keys.site[int(picture.values[row, column]) - 1].name
            what = (
                f"pixel ({column}, {rows - 1 - row}) of {shown(picture.file)} is site '{drawn}' "
                f"and lies in site '{site.name}'; move one of them"
            )
            raise InputError(f"{origin.where(('site', index), ('floor',))}: {what}")
