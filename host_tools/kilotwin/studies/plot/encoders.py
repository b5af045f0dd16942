"""Frames of a video written as a file: a GIF, or by ffmpeg."""

import contextlib
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import GifImagePlugin, Image

from kilotwin.files import extras
from kilotwin.files.plain_text import plain

FRAMES_S = 25
_FORMATS = {".mp4": "mp4", ".webm": "webm"}
# Small files at little CPU time: the default preset of libx264 takes twice as long for larger ones.
_CODECS = {
    ".mp4": ["libx264", "-preset", "veryfast"],
    ".webm": ["libvpx-vp9", "-deadline", "realtime", "-cpu-used", "6"],
}
SUFFIXES = (*_FORMATS, ".gif")
_NOTHING = 255  # the palette's entry of pixels that stay
GIF_COLOURS = 255
"""Colours that a GIF can have, beside that one."""


class FfmpegError(Exception):
    """Its last line."""


Frame = NDArray[np.uint8]  # [height, width, 4]; the next frame may use the same memory


class _Changes:
    """Which pixels a frame has otherwise than the one before."""

    def __init__(self) -> None:
        self._before: NDArray[np.uint32] | None = None

    def of(self, frame: Frame) -> NDArray[np.intp]:
        """Their places in the frame, flat; all of the first one."""
        pixels = frame.view(np.uint32).ravel()
        if self._before is None:
            self._before = pixels.copy()
            return np.arange(len(pixels))
        changed = np.flatnonzero(pixels != self._before)
        self._before[changed] = pixels[changed]
        return changed


def write_gif(file: Path, frames: Iterator[Frame], palette: NDArray[np.uint8]) -> None:
    """`palette`: [at most GIF_COLOURS, 3]. Each frame has the pixels that change, and what is
    around them is left as it is."""
    nearest = _nearest(palette)
    changes = _Changes()
    with file.open("wb") as out:
        shown: NDArray[np.uint8] | None = None
        for frame in frames:
            height, width = frame.shape[:2]
            if shown is None:
                _begin_gif(out, width, height, palette)
                shown = np.full(height * width, _NOTHING, dtype=np.uint8)
            changed = changes.of(frame)
            red, green, blue, _ = (frame.reshape(-1, 4)[changed] >> 2).T.astype(np.int32)
            colours = nearest[red << 12 | green << 6 | blue]
            other = colours != shown[changed]
            changed, colours = changed[other], colours[other]
            shown[changed] = colours
            _add_to_gif(out, changed, colours, width)
        out.write(b";")


def _begin_gif(out: BinaryIO, width: int, height: int, palette: NDArray[np.uint8]) -> None:
    size = width.to_bytes(2, "little") + height.to_bytes(2, "little")
    table = palette.tobytes().ljust(3 * 256, b"\0")
    for_ever = b"!\xff\x0bNETSCAPE2.0\x03\x01\0\0\0"
    out.write(b"GIF89a" + size + b"\xf7\0\0" + table + for_ever)


def _add_to_gif(
    out: BinaryIO, changed: NDArray[np.intp], colours: NDArray[np.uint8], width: int
) -> None:
    """The smallest rectangle around what has changed; a pixel that stays where nothing has."""
    rows, columns = np.divmod(changed, width) if len(changed) else np.zeros((2, 1), dtype=np.intp)
    top, left = int(rows.min()), int(columns.min())
    part = np.full((rows.max() - top + 1, columns.max() - left + 1), _NOTHING, dtype=np.uint8)
    if len(changed):
        part[rows - top, columns - left] = colours
    kept = {"transparency": _NOTHING, "disposal": 1, "interlace": 0}
    out.writelines(
        GifImagePlugin.getdata(
            Image.fromarray(part, "P"), (left, top), duration=1000 // FRAMES_S, **kept
        )
    )


def _nearest(palette: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """[2^18]: the entry that is nearest to the colour of six bits of red, green and blue."""
    levels = (np.arange(64, dtype=np.uint8) << 2) + 2
    every = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1)
    named = Image.new("P", (1, 1))
    named.putpalette(palette.tobytes())
    found = Image.fromarray(every.reshape(512, 512, 3)).quantize(
        palette=named, dither=Image.Dither.NONE
    )
    return np.asarray(found).ravel()


def write_by_ffmpeg(
    file: Path, suffix: str, frames: Iterator[Frame], size: tuple[int, int]
) -> None:
    """Writes .mp4 or .webm, `size` (width and height) in even numbers; FfmpegError if it
    fails."""
    extras.require("imageio_ffmpeg")
    import imageio_ffmpeg  # it takes a tenth of a second, and is an extra

    raw = ["-f", "rawvideo", "-pix_fmt", "yuv420p", "-s", "{}x{}".format(*size)]
    made = ["-an", "-c:v", *_CODECS[suffix], "-threads", "1", "-pix_fmt", "yuv420p", "-crf", "26"]
    words = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error"]
    words += [*raw, "-r", f"{FRAMES_S}", "-i", "-", *made]
    with (
        tempfile.TemporaryFile() as said,
        subprocess.Popen(
            [*words, "-fflags", "+bitexact", "-f", _FORMATS[suffix], file],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=said,
        ) as encoder,
    ):
        assert encoder.stdin is not None
        planes = _Planes(*size)
        with contextlib.suppress(BrokenPipeError):  # it says itself why it has ended
            for frame in frames:
                encoder.stdin.write(planes.of(frame).data)
            encoder.stdin.close()
        if encoder.wait() != 0:
            said.seek(0)
            lines = said.read().decode(errors="replace").splitlines() or ["it does not say why"]
            raise FfmpegError(plain(lines[-1]))


class _Planes:
    """A frame in brightness and two differences of colour (BT.601, a quarter as fine), of which
    only the pixels that change are worked out."""

    _WEIGHTS = np.array(
        [[65.481, 128.553, 24.966], [-37.797, -74.203, 112.0], [112.0, -93.786, -18.214]],
        dtype=np.float32,
    ) / np.float32(255)

    def __init__(self, width: int, height: int) -> None:
        self._width, self._pixels = width, width * height
        self._bytes = np.zeros(width * height * 3 // 2, dtype=np.uint8)
        self._changes = _Changes()

    def of(self, frame: Frame) -> NDArray[np.uint8]:
        """The bytes of the three, one after the other."""
        changed = self._changes.of(frame)
        pixels = frame.reshape(-1, 4)
        self._bytes[changed] = pixels[changed, :3] @ self._WEIGHTS[0] + np.float32(16.5)
        rows, columns = np.divmod(changed, self._width)
        corner = (rows & ~1) * self._width + (columns & ~1)
        corner = corner[np.append(True, corner[1:] != corner[:-1])] if len(corner) else corner
        four = [pixels[corner + at, :3] for at in (0, 1, self._width, self._width + 1)]
        mean = sum(one.astype(np.float32) for one in four) / np.float32(4)
        quarter = self._pixels // 4
        place = corner // self._width // 2 * (self._width // 2) + corner % self._width // 2
        for number in (1, 2):
            plane = self._bytes[self._pixels + (number - 1) * quarter :]
            plane[place] = mean @ self._WEIGHTS[number] + np.float32(128.5)
        return self._bytes
