"""A run as a video: the table from above, robots where they are at each frame's time."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb, to_rgba_array
from matplotlib.figure import Figure
from matplotlib.text import Text
from numpy.typing import NDArray
from PIL import Image

from kilotwin.errors import InputError, RunError, cause_of
from kilotwin.experiment.areas import area_of
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.spec.objects import areas_at
from kilotwin.experiment.states import States
from kilotwin.files.drafts import draft_of
from kilotwin.runs.palette import FLOOR, OBJECT, OUTLINE, state_colours
from kilotwin.runs.reader import Run
from kilotwin.runs.samples import RunSamples
from kilotwin.runs.sampling import coarseness
from kilotwin.studies.plot.discs import Discs
from kilotwin.studies.plot.encoders import (
    FRAMES_S,
    GIF_COLOURS,
    SUFFIXES,
    FfmpegError,
    Frame,
    write_by_ffmpeg,
    write_gif,
)
from kilotwin.studies.plot.labels import Label
from kilotwin.studies.plot.map import area_patch, draw_floor, points_per_metre
from kilotwin.studies.plot.points import RADIUS_PX, Points
from kilotwin.studies.plot.style import draw, title
from kilotwin.units import counted

_TARGET_S = 30.0
_DPI = 100
_TRAIL_SAMPLES = 20
_TURN = 65536
# Colours of a GIF's 256 that states may take.
_MOST_OF_STATES = 192
_CLOSE = 8
_ZOOM_SHARE = 0.8


@dataclass(frozen=True)
class Film:
    """Which part of a run, how fast, how large; None is all of it, in half a minute.

    `speed`: simulated seconds in a second. `width_px`: of the picture, 160 to 3840. `zoom_m`: so
    many metres around the table's middle are seen at first, and all of it from four fifths on.
    """

    speed: float | None = None
    from_s: float | None = None
    to_s: float | None = None
    width_px: int = 960
    trails: bool = False
    zoom_m: float | None = None


def write_video(run: Run, target: Path, film: Film, part: Callable[[float], None]) -> str:
    """Writes .mp4, .webm or .gif; returns a line that says what is in it.

    The same run and film give the same frames. `part` is called with the share that is done.
    InputError: another suffix, a run without places, a part that it has not, a place that cannot
    be written.
    RunError: no encoder.
    """
    if target.suffix.lower() not in SUFFIXES:
        raise InputError(f"-o {target}: not a kind of video; end the name in .mp4, .webm or .gif")
    run.need("x_m", "y_m")
    samples = RunSamples.of(run)
    times, speed = _times(run, samples, film)
    picture = _Picture(run, samples, film, speed)
    widening = _widening(run, film)
    frames = (
        picture.at(time_s, widening(share))
        for time_s, share in zip(times, np.linspace(0, 1, len(times)), strict=True)
    )
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with draft_of(target) as draft:
            _encode(draft, target, _counted(frames, len(times), part), picture)
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"-o {target}: cannot be written ({reason}); name another file") from None
    return (
        f"{target}: {times[0]:,.0f} s to {times[-1]:,.0f} s at {speed:g} times real time, "
        f"{counted(len(times), 'frame')} of {picture.size[0]} x {picture.size[1]}"
        + (f"; {picture.note}" if picture.note else "")
    )


def _times(run: Run, samples: RunSamples, film: Film) -> tuple[NDArray[np.float64], float]:
    """The time of each frame, and the speed."""
    if not samples.samples:
        raise InputError(f"{run.folder}: no sample was recorded; let the run go on for longer")
    known = samples.times_s()
    first = known[0] if film.from_s is None else film.from_s
    last = known[-1] if film.to_s is None else min(film.to_s, known[-1])
    if not known[0] <= first < last:
        raise InputError(
            f"--from {first:g} --to {last:g}: the run was recorded from {known[0]:.0f} s to "
            f"{known[-1]:.0f} s; name a part of that"
        )
    speed = film.speed or _round((last - first) / _TARGET_S)
    number = int((last - first) / speed * FRAMES_S) + 1
    return first + np.arange(number) * speed / FRAMES_S, speed


def _widening(run: Run, film: Film) -> Callable[[float], float]:
    """How much of the table's width is seen, up to 1, by the share of the film that is over."""
    arena = area_of(run.experiment.arena)
    whole_m = max(arena.width, arena.height)
    if film.zoom_m is None:
        return lambda _share: 1.0
    if not 0 < film.zoom_m <= whole_m:
        raise InputError(
            f"--zoom {film.zoom_m:g}: name metres above 0, and no more than the table has, "
            f"{whole_m:g}"
        )
    first = film.zoom_m / whole_m

    def seen(share: float) -> float:
        """By equal factors in equal times, but gently at both ends."""
        done = min(1.0, share / _ZOOM_SHARE)
        return float(first ** (1 - done * done * (3 - 2 * done)))

    return seen


def _round(speed: float) -> float:
    """The next one of 1, 2, 5, 10, ... times real time; at least real time."""
    speed = max(1.0, speed)
    power = 10.0 ** np.floor(np.log10(speed))
    return float(next(step * power for step in (1, 2, 5, 10) if step * power >= speed * 0.999))


def _counted(
    frames: Iterator[Frame], number: int, part: Callable[[float], None]
) -> Iterator[Frame]:
    for done, frame in enumerate(frames):
        part(done / number)
        yield frame


def _encode(file: Path, target: Path, frames: Iterator[Frame], picture: "_Picture") -> None:
    """Writes `file`, which becomes `target`; RunError if the encoder fails."""
    suffix = target.suffix.lower()
    if suffix == ".gif":
        write_gif(file, frames, picture.palette())
        return
    try:
        write_by_ffmpeg(file, suffix, frames, picture.size)
    except FfmpegError as error:
        raise RunError(f"-o {target}: ffmpeg cannot encode it ({error})") from None


class _Picture:
    """Draws frames: what stands still once, robots and words anew."""

    def __init__(self, run: Run, samples: RunSamples, film: Film, speed: float) -> None:
        self._run = run
        self._samples = samples
        self._times = samples.times_s()
        self._states = states = States.of(run.experiment)
        named = self._named = state_colours(states.names)
        self._colours = np.array([_bytes_of(named[states.names[one]]) for one in states.of_led])
        self._trails = film.trails
        self._speed = speed
        self._read_at = -1
        self._read: dict[str, NDArray[Any]] = {}
        self.note = coarseness(run, speed / FRAMES_S)
        """A line below the picture; "" for none."""
        self._radius = PROFILES[run.experiment.swarm.profile].radius_m
        draw(lambda: self._make(film.width_px))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        width, height = self._canvas.get_width_height()
        return width, height

    def palette(self) -> NDArray[np.uint8]:
        """[colours, 3] of all frames of a GIF: those of states as they are, mixtures of these with
        what may be around robots, and then what stands still needs."""
        states = to_rgba_array([self._named[name] for name in self._states.names])[:, :3]
        around = to_rgba_array([FLOOR, "white", "black", OUTLINE])[:, :3]
        mixtures = [(states[: self._states.known] + colour) / 2 for colour in around]
        own = np.round(255 * np.concatenate([around, states, *mixtures]))[:_MOST_OF_STATES]
        still = Image.fromarray(self._still[..., :3])
        found = still.quantize(GIF_COLOURS - len(own)).getpalette() or []
        # Pillow finds the nearest colour by its upper bits: none may be close to one of ours.
        others = np.array(found, dtype=float).reshape(-1, 3)
        far = np.abs(others[:, None] - own).max(axis=2).min(axis=1) > _CLOSE
        return np.concatenate([own, others[far]]).astype(np.uint8)

    def _make(self, width_px: int) -> Figure:
        """The floor, and what will be moved over it."""
        width_px -= width_px % 2
        height_px = round(width_px * 0.75 / 2) * 2
        figure = Figure(figsize=(width_px / _DPI, height_px / _DPI), dpi=_DPI)
        self._canvas = FigureCanvasAgg(figure)
        axes = figure.add_axes((0.03, 0.03, 0.7, 0.87))
        draw_floor(axes, self._run.experiment, self._run.floor())
        axes.set(aspect="equal")
        axes.set_axis_off()
        self._limits = np.array([axes.get_xlim(), axes.get_ylim()])
        # Text fits its column; in small pictures it is as small as can be read.
        scale = max(0.5, min(width_px / 720, 1), width_px / 960)
        heading = figure.text(0.03, 0.94, title(self._run), size=12 * scale, weight="bold")
        _shrink([heading])
        if self.note:
            _shrink([figure.text(0.03, 0.01, self.note, size=9 * scale)])
        self._axes = axes
        self._trail = axes.plot([], [], color=OUTLINE, lw=0.6, alpha=0.5, animated=True)[0]
        names = self._states.names[: self._states.known]
        widest = self._time(self._times[-1])
        clock = figure.text(0.75, 0.88, widest, size=11 * scale, animated=True)
        line = min(0.04, 0.8 / max(1, len(names)))
        scale *= line / 0.04
        counts = []
        for number, name in enumerate(names):
            low = 0.83 - line * number
            figure.text(0.75, low, "●", size=13 * scale, color=self._named[name])
            widest = f"{name}: {len(self._samples.robots.ids)}"
            counts.append(figure.text(0.78, low, widest, size=11 * scale, animated=True))
        _shrink([clock])
        _shrink(counts)
        self._look(1.0)
        self._clock = Label(clock, self._still)
        self._counts = [Label(count, self._still) for count in counts]
        box = axes.get_window_extent()
        self._table = (
            slice(height_px - round(box.y1), height_px - round(box.y0)),
            slice(round(box.x0), round(box.x1)),
        )
        return figure

    def _look(self, part: float) -> Figure:
        """Draws what stands still, of that part of the table's width, around its middle."""
        self._part = part
        middle, half = self._limits.mean(axis=1), np.ptp(self._limits, axis=1) / 2
        self._axes.set_xlim(*(middle[0] + part * half[0] * np.array([-1, 1])))
        self._axes.set_ylim(*(middle[1] + part * half[1] * np.array([-1, 1])))
        self._canvas.draw()  # type: ignore[no-untyped-call]
        drawn = self._canvas.buffer_rgba()  # type: ignore[no-untyped-call]
        self._pixels: Frame = np.asarray(drawn)
        self._still = self._pixels.copy()
        metre = points_per_metre(self._axes) * _DPI / 72
        outline = min(0.6 * _DPI / 72, 0.08 * 2 * self._radius * metre)
        lines = outline, max(outline, 0.3 * _DPI / 72)
        radius = self._radius * metre
        self._robots: Discs | Points = (
            Points(self._colours)
            if radius < RADIUS_PX
            else Discs(radius, lines, _bytes_of(OUTLINE), self._colours)
        )
        return self._canvas.figure

    def at(self, time_s: float, part: float) -> Frame:
        """[height, width, 4] of a time, until the next is drawn; `part` of the table's width."""
        if part != self._part:
            draw(lambda: self._look(part))
        number = max(0, int(np.searchsorted(self._times, time_s, side="right")) - 1)
        following = min(number + 1, len(self._times) - 1)
        if number != self._read_at:
            self._read, self._read_at = self._samples.read(sorted({number, following})), number
            if self._trails:
                self._before = self._samples.read(
                    range(max(0, number - _TRAIL_SAMPLES), number + 1)
                )
        read = self._read
        span = self._times[following] - self._times[number]
        share = 0.0 if span <= 0 else float(np.clip((time_s - self._times[number]) / span, 0, 1))
        x, y = (_between(read[name], share) for name in ("x_m", "y_m"))
        self._pixels[...] = self._still
        self._draw_objects(read, share)
        if self._trails:
            self._draw_trails(x, y)
        self._draw_robots(read, x, y, share)
        self._draw_text(read.get("led"), time_s)
        return self._pixels

    def _draw_robots(
        self, read: dict[str, NDArray[Any]], x: NDArray[Any], y: NDArray[Any], share: float
    ) -> None:
        led = read["led"][0] & 63 if "led" in read else np.zeros(len(x), dtype=np.uint8)
        centres = self._axes.transData.transform(np.column_stack([x, y]))
        centres[:, 1] = self._pixels.shape[0] - centres[:, 1]
        heading = _turned(read["heading_rad"], share) if "heading_rad" in read else None
        self._robots.draw(self._pixels, centres, heading, led, self._table)

    def _draw_trails(self, x: NDArray[Any], y: NDArray[Any]) -> None:
        """One line, with gaps between robots."""
        gap = np.full(len(x), np.nan)
        for name, now, put in (
            ("x_m", x, self._trail.set_xdata),
            ("y_m", y, self._trail.set_ydata),
        ):
            put(np.vstack([self._before[name], now, gap]).T.ravel())
        self._axes.draw_artist(self._trail)

    def _draw_objects(self, read: dict[str, NDArray[Any]], share: float) -> None:
        if "object_x_m" not in read:
            return
        heading = _turned(read["object_heading_rad"], share)
        x, y = (_between(read[f"object_{name}"], share) for name in ("x_m", "y_m"))
        for thing, *pose in zip(self._run.experiment.object, x, y, heading, strict=True):
            for part in areas_at(thing, [float(value) for value in pose]):
                patch = area_patch(part, facecolor=OBJECT, edgecolor=OUTLINE, lw=1)
                patch.set_transform(self._axes.transData)
                patch.set_figure(self._axes.figure)
                self._axes.draw_artist(patch)

    def _draw_text(self, led: NDArray[np.uint8] | None, time_s: float) -> None:
        self._clock.draw(self._pixels, self._time(time_s))
        if led is None:
            return
        shown = self._states.of_robots(led[0])
        for state, label in enumerate(self._counts):
            name = self._states.names[state]
            label.draw(self._pixels, f"{name}: {np.count_nonzero(shown == state)}")

    def _time(self, time_s: float) -> str:
        return f"{time_s:,.1f} s   ({self._speed:g}x)"


def _bytes_of(colour: str) -> NDArray[np.uint8]:
    """[3]: red, green, blue."""
    return np.round(255 * np.array(to_rgb(colour))).astype(np.uint8)


def _shrink(texts: Sequence[Text]) -> None:
    """All by as much that none goes beyond the picture's right edge, hinted or not."""
    shares = [1.0]
    for text in texts:
        box, figure = text.get_window_extent(), text.get_figure(root=True)
        assert figure is not None
        shares.append((0.97 * figure.bbox.width - box.x0) / box.width)
    for text in texts:
        text.set_fontsize(min(shares) * float(text.get_fontsize()))


def _between(values: NDArray[Any], share: float) -> NDArray[Any]:
    """The value at that share of the way from the first row to the last."""
    return np.asarray(values[0] + share * (values[-1] - values[0]))


def _turned(headings: NDArray[np.uint16], share: float) -> NDArray[np.float64]:
    """The same of headings in 2^16 parts of a turn, by the shorter way; rad."""
    turns = headings.astype(np.int64)
    turn = (turns[-1] - turns[0] + 3 * _TURN // 2) % _TURN - _TURN // 2
    return np.asarray(2 * np.pi / _TURN * (turns[0] + share * turn))
