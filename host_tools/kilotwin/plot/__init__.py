"""Figures of run folders, as PNG, SVG or PDF."""

from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from kilotwin.errors import InputError
from kilotwin.plot import style
from kilotwin.plot.map import draw_map
from kilotwin.plot.timeline import draw_timeline
from kilotwin.run_reader import Run

FIGURES: dict[str, Callable[[Run], Figure]] = {"map": draw_map, "timeline": draw_timeline}
_SUFFIXES = {".png", ".svg", ".pdf"}


def write_figure(figure: str, folder: Path, target: Path) -> None:
    """Draws one figure of a run; what cannot be drawn or written is an InputError."""
    if target.suffix.lower() not in _SUFFIXES:
        raise InputError(f"-o {target}: not a kind of picture; end the name in .png, .svg or .pdf")
    run = Run.open(folder)
    drawn = style.draw(FIGURES[figure], run)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        style.save(drawn, target)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"-o {target}: cannot be written ({reason}); name another file") from None
