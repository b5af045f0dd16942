"""Words of a video that change from frame to frame."""

import numpy as np
from matplotlib.font_manager import findfont
from matplotlib.text import Text
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont


class Label:
    """A text in place of one of matplotlib's, which takes a millisecond for each new word."""

    def __init__(self, text: Text, still: NDArray[np.uint8]) -> None:
        """At the place and in the font of `text`, over the picture `still`, [height, width, 4]."""
        figure = text.get_figure(root=True)
        assert figure is not None
        pixels = float(text.get_fontsize()) * figure.dpi / 72
        self._font = ImageFont.truetype(findfont(text.get_fontproperties()), pixels)
        x, y = text.get_transform().transform(text.get_position())
        self._left, self._base = round(x), round(still.shape[0] - y)
        self._still = still
        self._shown = ""
        self._part = (slice(0), slice(0))
        self._pixels = still[self._part]

    def draw(self, picture: NDArray[np.uint8], words: str) -> None:
        """Draws black words into a picture of that size."""
        if words != self._shown:
            self._shown = words
            left, top, right, low = self._font.getbbox(words, anchor="ls")
            left, top = int(left), int(top)
            ink = Image.new("L", (int(right) - left, int(low) - top))
            ImageDraw.Draw(ink).text((-left, -top), words, 255, self._font, "ls")
            top, left = self._base + top, self._left + left
            height, width = self._still.shape[:2]
            cut = np.asarray(ink)[: height - top, : width - left]
            self._part = (slice(top, top + cut.shape[0]), slice(left, left + cut.shape[1]))
            below = self._still[self._part].astype(np.uint16)
            self._pixels = (below * (255 - cut[..., None].astype(np.uint16)) // 255).astype(
                np.uint8
            )
            self._pixels[..., 3] = 255
        picture[self._part] = self._pixels
