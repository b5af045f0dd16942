"""Pictures as a page takes them."""

import base64
import io
from typing import Any

from numpy.typing import NDArray
from PIL import Image


def as_png(pixels: NDArray[Any]) -> str:
    """[rows, columns, 4] bytes of red, green, blue and cover, the lowest row first, in base64."""
    made = io.BytesIO()
    Image.fromarray(pixels[::-1], "RGBA").save(made, "PNG")
    return base64.b64encode(made.getvalue()).decode()
